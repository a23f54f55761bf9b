// The page: connects its parts.
import 'uplot/dist/uPlot.min.css';
import '../style/page.css';
import { Connection } from './link/connection.js';
import { ClockMapping } from './link/clock.js';
import { Requests } from './link/requests.js';
import { Played } from './streams/played.js';
import { Store } from './streams/store.js';
import { stateOf } from './streams/words.js';
import { World } from './scene/world.js';
import { Avatars } from './scene/avatars.js';
import { Capture } from './scene/capture.js';
import { Acks, controlWith } from './panel/acks.js';
import { CameraPanel } from './panel/camera.js';
import { Chosen } from './panel/chosen.js';
import { Header } from './panel/header.js';
import { Help } from './panel/help.js';
import { ModelLibrary, Recordings } from './panel/library.js';
import { SettingsPanel } from './panel/settings_panel.js';
import { StreamList } from './panel/stream_list.js';
import { Takes } from './panel/takes.js';
import { Theme } from './panel/theme.js';
import { TimeControls } from './panel/time_controls.js';
import { Tools } from './panel/tools.js';
import { Ways } from './panel/ways.js';
import { listenToKeys } from './panel/keyboard.js';
import { isSlow, ms } from './panel/numbers.js';
import { Instruments } from './instruments/instruments.js';
import { FrameTimes } from './instruments/frame_times.js';
import { legend } from './panel/legend.js';
import { writeTags } from './panel/tags.js';
import { emptyWords } from './panel/empty.js';

const find = (selector) => document.querySelector(selector);

class Page {
  store = new Store();
  clock = new ClockMapping();
  times = new FrameTimes();
  hello = null;
  daemon = { alive: true, sentence: '' };
  chosenName = null;
  link = { state: 'connecting', sentence: '' };
  #tagged_ms = 0;

  constructor() {
    const token = new URLSearchParams(location.search).get('token') ?? '';
    this.header = new Header(find('.bar'));
    // Early, because its way to the bridge and back takes time that the rest can use.
    this.connection = new Connection(token, {
      state: (state, sentence) => this.#linkChanged(state, sentence),
      open: () => this.clock.clear(),
      binary: (bytes) => this.store.receive(bytes, (...reply) => this.requests.reply(...reply)),
      text: (message) => this.#told(message),
    });
    this.requests = new Requests((bytes) => this.connection.sendBytes(bytes));
    this.acks = new Acks(find('.acks'));
    this.control = controlWith(this.requests, this.acks);
    this.theme = new Theme(find('#theme'), (name) => this.#retheme(name));
    if (!this.#makeWorld()) return;
    this.instruments = new Instruments(find('.instruments'));
    this.#makePanels();
    this.#listen();
    requestAnimationFrame((now) => this.#frame(now));
  }

  // False where WebGL is off, as in some virtual machines: the page says so and ends.
  #makeWorld() {
    try {
      this.world = new World(find('.stage'), this.store, this.theme.name);
      return true;
    } catch (error) {
      console.error(error);
      this.connection.close();
      this.#linkChanged('refused', NO_WEBGL);
      return false;
    }
  }

  #makePanels() {
    const { control, requests, acks, store, world } = this;
    this.list = new StreamList(find('.stream-list'), store, (name) => this.choose(name));
    this.panel = new Chosen(
      find('.chosen'),
      { control, requests, acks, store },
      () => this.hello?.connect ?? '',
    );
    this.takes = new Takes(find('.takes'), control, (...words) => acks.say(...words));
    this.camera = new CameraPanel((message) => this.connection.sendText(message));
    find('.streams').after(this.camera.element);
    this.ways = new Ways(() => this.#refresh());
    find('.streams').after(this.ways.element);
    this.help = new Help(find('#help'), find('#help-button'), () => {
      const [first] = [...this.world.performers.values()].filter(({ ghost }) => !ghost);
      return first?.colour ?? 'var(--styled)';
    });
    const say = (...words) => acks.say(...words);
    this.avatars = new Avatars(world, say, () => this.settings?.update());
    this.capture = new Capture(world, say);
    this.tools = new Tools(find('.tools'), world, this.capture);
    this.settings = new SettingsPanel(
      find('#settings'),
      find('#settings-button'),
      world,
      this.avatars,
    );
    this.time = new TimeControls(find('.tools'), store, world);
    this.library = new ModelLibrary({ control, requests, acks }, () => this.panel.listModels());
    this.played = new Played(store);
    this.recordings = new Recordings({ control, requests, acks, played: this.played });
    find('.shelves').append(this.library.element, this.recordings.element);
    this.legend = legend(find('.legend'));
  }

  #listen() {
    this.store.addEventListener('stats', () => this.#refresh());
    this.store.addEventListener('skeleton', ({ detail }) => this.#dress(detail));
    this.store.addEventListener('event', ({ detail }) => this.#event(detail));
    const style = (change) => () => {
      if (this.panel.style?.alpha && !this.readOnly) change(this.panel.style.alpha);
    };
    listenToKeys({
      ArrowDown: () => this.#step(1),
      ArrowUp: () => this.#step(-1),
      ArrowLeft: style((alpha) => alpha.nudge(-0.05)),
      ArrowRight: style((alpha) => alpha.nudge(0.05)),
      0: style((alpha) => alpha.nudge(-alpha.value)),
      p: () => this.time.toggle(),
      r: () => this.tools.nextRaw(),
      t: () => this.tools.toggleTrails(),
      g: () => this.panel.gesture?.line.focus(),
      s: () => this.takes.toggle(),
      d: () => this.theme.toggle(),
      o: () => this.settings.toggle(),
      '?': () => this.help.toggle(),
      ...Object.fromEntries(
        ['follow', 'orbit', 'front', 'side', 'top'].map((view, i) => [
          i + 1,
          () => this.world.views.set(view),
        ]),
      ),
    });
  }

  get chosen() {
    return this.store.streams.get(this.chosenName) ?? null;
  }

  get readOnly() {
    if (!this.hello) return 'there is no connection to posed view yet';
    return this.hello.may_control ? '' : this.hello.read_only_reason || 'this page may only look';
  }

  // A replay's times are those of its recording: this page's clock says nothing about them.
  get #poseClock() {
    return this.store.stats?.replay_file === '' ? this.clock : UNKNOWN_CLOCK;
  }

  choose(name) {
    this.chosenName = name;
    this.#refresh();
  }

  #step(step) {
    const names = this.store.main().map(({ name }) => name);
    if (names.length === 0) return;
    this.choose(names[(names.indexOf(this.chosenName) + step + names.length) % names.length]);
  }

  async #dress(stream) {
    const performer = this.world.performers.get(stream.name);
    if (!performer) return;
    try {
      await this.avatars.dress(performer);
    } catch (error) {
      this.acks.say(error.message, 'bad');
    }
  }

  #event({ stream, kind, text }) {
    const tone = {
      warning: 'bad',
      lost: 'bad',
      stale: 'busy',
      'recording error': 'bad',
      ended: 'busy',
    }[kind];
    if (tone) this.acks.say(`${stream}: ${text}`, tone);
  }

  #linkChanged(state, sentence) {
    this.link = { state, sentence };
    if (state !== 'connecting') {
      this.hello = null;
      this.requests.abandon();
    }
    if (!this.hello) this.store.silence();
    this.#sayLink();
    if (this.legend) this.#refresh(); // the panels are there
  }

  #told(message) {
    const { type } = message;
    if (type === 'hello') {
      this.hello = message;
      this.link = { state: 'open', sentence: '' };
    } else if (type === 'control') {
      Object.assign(this.hello ?? {}, message);
    } else if (type === 'daemon') {
      this.daemon = message;
      if (!message.alive) this.store.silence();
    } else if (type === 'clock') {
      // Of another machine's frames nobody here knows when they came.
      if (this.hello?.same_machine)
        this.clock.add(message.t0, performance.now(), Number(message.monotonic_ns) / 1e6);
      return;
    } else if (type === 'landmarks') {
      this.camera.told(message);
      return;
    } else if (type === 'no_reply') {
      this.requests.refused(message.request, message.error);
      return;
    }
    this.#sayLink();
    this.#refresh();
  }

  // What is wrong with the way to the daemon, for the header and the empty scene.
  #sayLink() {
    const { state, sentence } = this.link;
    if (state === 'refused') this.header.say(sentence, 'bad');
    else if (!this.hello) this.header.say(sentence || 'connecting', 'busy');
    else if (!this.daemon.alive)
      this.header.say(this.daemon.sentence || 'the daemon does not answer', 'bad');
    else this.header.say(...this.#liveWords());
    document.body.dataset.silent = !this.hello || !this.daemon.alive;
    emptyWords(find('.empty p'), this);
  }

  // Who sees an old picture must not read "live".
  #liveWords() {
    if (this.store.rewind.paused) return ['paused', 'busy'];
    const age_ms = this.chosen ? this.instruments.history(this.chosen).picture_ms : NaN;
    if (isSlow(age_ms)) return [`this page is slow: picture ${ms(age_ms)} old`, 'busy'];
    const worst = this.store.main().find(({ stats }) => stateOf(stats).tone === 'bad');
    const connected = `connected to ${this.hello.connect}`;
    if (worst) return [`${connected}; ${worst.name}: ${stateOf(worst.stats).word}`, 'busy'];
    return [connected, 'good'];
  }

  #refresh() {
    const { store } = this;
    const mains = store.main();
    if (!this.chosen || !mains.includes(this.chosen)) this.chosenName = mains[0]?.name ?? null;
    this.world.choose(this.chosenName);
    this.list.update(this.chosen);
    this.panel.update(this.chosen, this.readOnly);
    this.ways.update(this.hello && this.daemon.alive ? store.stats : null, this.hello?.connect);
    this.library.update(this.chosen);
    this.settings.update();
    this.takes.update(store.stats, this.readOnly);
    this.camera.update(this.hello, this.readOnly);
    this.header.update(this.hello && this.daemon.alive ? store.stats : null);
    this.instruments.heading.textContent = this.chosen
      ? `Instruments: ${this.chosenName}`
      : 'Instruments';
    writeTags(this.world, this.chosenName);
    this.legend(this.world);
    emptyWords(find('.empty p'), this);
  }

  #retheme(name) {
    this.world?.setTheme(name);
    this.instruments?.retheme();
    this.world?.touch();
  }

  // One per screen refresh: the bridge may send the next poses, then the newest ones are drawn.
  #frame(now_ms) {
    requestAnimationFrame((next) => this.#frame(next));
    const began_ms = performance.now();
    this.connection.sendText(READY);
    this.fresh = [];
    this.played.frame(performance.now());
    this.world.ease(this.camera.camera.isBusy);
    const drawn = this.world.frame(({ stream }) => stream.isTake || this.fresh.push(stream));
    const done_ms = performance.now();
    // What is shown of the past is no measure of the present.
    if (this.store.rewind.paused) this.fresh.length = 0;
    for (const stream of this.fresh) this.instruments.add(stream, done_ms, this.#poseClock);
    if (drawn && this.chosen) this.panel.mark(this.chosen);
    if (now_ms - this.#tagged_ms > TAGS_EVERY_MS) {
      this.#tagged_ms = now_ms;
      writeTags(this.world, this.chosenName);
      this.#sayLink();
    }
    this.instruments.frame(this.chosen, now_ms);
    this.times.add(performance.now() - began_ms);
  }
}

const READY = { type: 'ready' };
const TAGS_EVERY_MS = 150;
const NO_WEBGL =
  'this browser draws no WebGL: switch on hardware acceleration, or use posed top in a terminal';
const UNKNOWN_CLOCK = new ClockMapping();

// For the tests and for who looks into a running page.
globalThis.posedPage = new Page();
