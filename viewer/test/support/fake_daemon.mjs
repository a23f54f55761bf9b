// What the fake bridge publishes and how it answers: a daemon of a few lines. Styled walkers with
// their raw twins, hands that sign.
import { SIGNS, bodySkeleton, handSkeleton, hold, walk, walkBvh } from './figures.mjs';
import { encode } from './messages.mjs';

const BODY_JOINTS = bodySkeleton({ stage: [] }).parent;
const ALPHA_PER_S = 2;
const GESTURE_S = 0.7;
const RECORDED = Uint8Array.from({ length: 70000 }, (_, i) => i % 251); // bytes of a clip
// Six moments of a stride, as posed draws them.
const STRIP = [
  'M47 93L46 67L45 44L44 34M45 44L47 50L54 76L79 85',
  'M45 44L43 50L37 77L48 98M47 93L37 138L16 174L30 180',
  'M47 93L76 131L78 173L93 172M142 93L141 66L140 43L139 34',
  'M140 43L141 49L147 75L171 85M140 43L139 49L134 77L145 99',
  'M142 93L136 139L103 165L107 179M142 93L166 134L159 175L174 180',
  'M237 91L236 65L235 42L235 32M235 42L234 48L233 76L251 94',
  'M235 42L237 47L238 74L257 90M237 91L262 131L236 165L244 177',
  'M237 91L243 136L230 176L245 180M332 93L331 67L330 44L330 35',
  'M330 44L327 52L322 81L333 103M330 44L333 48L340 72L364 81',
  'M332 93L362 131L363 173L378 172M332 93L321 137L302 174L316 180',
  'M427 93L427 66L425 43L425 34M425 43L423 52L418 81L429 104',
  'M425 43L428 46L433 70L457 80M427 93L450 134L444 175L459 180',
  'M427 93L421 140L387 165L392 179M522 91L521 65L520 42L519 32',
  'M520 42L520 50L522 78L541 95M520 42L520 46L519 72L537 88',
  'M522 91L528 136L514 176L529 180M522 91L546 131L521 165L529 177',
].join('');
const TAKE = new TextEncoder().encode(walkBvh(60, 30));
const ROOTS = ['off', 'stride', 'actor'];

export class FakeDaemon {
  frames = 0;
  take = null;
  models = [
    {
      name: 'march-to-sway.style',
      kind: 'style',
      learnt: 'turns march into sway, from 12 clips of ann',
      strip: STRIP,
    },
    {
      name: 'tired.style',
      kind: 'style',
      verdict: "learnt 90 % of the difference to 'tired', tested on motion it had not seen",
      strip: 'M1',
    },
    { name: 'hand.gesture', kind: 'generate', learnt: 'gestures g 1 c' },
  ];
  recordings = [
    { name: '20261126T065505Z.plog', bytes: 9e6, changed_unix_s: 1795590000, in_use: true },
    { name: '20261126T065505Z-1-walker.bvh', bytes: RECORDED.length, changed_unix_s: 1795580000 },
    { name: '20261126T065505Z-2-walker.bvh', bytes: TAKE.length, changed_unix_s: 1795580000 },
  ];
  takes = 0;

  // bodies, hands: how many; rate_hz: of all of them; missing: joints of styled bodies without a
  // value
  constructor({
    bodies = 1,
    hands = 1,
    rate_hz = 60,
    recording = true,
    missing = [],
    replay_file = '',
  } = {}) {
    this.replay_file = replay_file;
    this.rate_hz = rate_hz;
    this.recording = recording;
    this.recorder_trouble = ''; // why the log cannot be written
    this.missing = missing;
    this.began = process.hrtime.bigint();
    const names = (word, count) =>
      Array.from({ length: count }, (_, i) => (i === 0 ? word : `${word}${i + 1}`));
    this.bodies = names('walker', bodies).map((name, i) => ({
      name,
      id: 100 + i,
      alpha: 1,
      target: 1,
      mask: '',
      weights: 'sway=0.7,march=0.3',
      root: 1,
      limit_cm: 8,
      model: 'march-to-sway.style',
    }));
    this.hands = names('hand', hands).map((name, i) => ({
      name,
      id: 200 + i,
      model: 'hand.gesture',
      labels: Object.keys(SIGNS),
      play: [],
      began_s: 0,
      loop: false,
    }));
  }

  now_ns() {
    return process.hrtime.bigint();
  }

  time_s() {
    return Number(this.now_ns() - this.began) / 1e9;
  }

  skeletons() {
    const list = [];
    for (const { name, id } of this.bodies) {
      list.push(
        bodySkeleton({ stream: name, id, rate_hz: this.rate_hz, stage: ['style', 'feet'] }),
      );
      list.push(
        bodySkeleton({ stream: `${name}-raw`, id: id + 50, rate_hz: this.rate_hz, stage: [] }),
      );
    }
    for (const { name, id } of this.hands) {
      list.push(
        handSkeleton({ stream: name, id, rate_hz: this.rate_hz, stage: ['generate', 'constrain'] }),
      );
    }
    return list.map((message) => [`skeleton/${message.stream}`, encode('Skeleton', message)]);
  }

  // The frames of this moment: [topic, bytes]; the last of `count`.
  poses(count = 1) {
    this.frames += count;
    const time_s = this.time_s();
    const list = [];
    this.bodies.forEach((body, i) => {
      const step = (count * ALPHA_PER_S) / this.rate_hz;
      body.alpha += Math.max(-step, Math.min(step, body.target - body.alpha));
      list.push(
        this.#frame(body.name, body.id, walk(time_s + 0.3 * i, body.alpha), {
          validity: this.#validity(),
          quality: this.missing.length > 0 ? 1 : 0,
          stage_us: [90 + 20 * Math.random(), 30],
        }),
      );
      list.push(this.#frame(`${body.name}-raw`, body.id + 50, walk(time_s + 0.3 * i, 0), {}));
    });
    for (const hand of this.hands) {
      list.push(this.#frame(hand.name, hand.id, ...this.#sign(hand, time_s)));
      const sample = { stream: hand.name, sequence: this.frames, name: ['raw_index', 'index'] };
      Object.assign(sample, { value: [100, 0.5], validity: new Uint8Array([1, 1]) });
      list.push([`sensor/${hand.name}`, encode('Sample', sample)]);
    }
    return list;
  }

  #validity() {
    return BODY_JOINTS.map((_, joint) => (this.missing.includes(joint) ? 0 : 1));
  }

  #sign(hand, time_s) {
    const step = Math.floor((time_s - hand.began_s) / GESTURE_S);
    const performs = hand.play.length > 0 && (hand.loop || step < hand.play.length);
    const live = Object.keys(SIGNS)[Math.floor(time_s / 1.5) % 6];
    const label = performs ? hand.play[step % hand.play.length] : live;
    const label_probability = performs ? 1 : 0.8 + 0.15 * Math.sin(3 * time_s);
    return [
      hold(label, Math.sin(5 * time_s)),
      {
        label,
        label_probability,
        source: performs ? 3 : 0,
        lag_frames: 1,
        lag_ms: 1000 / this.rate_hz,
        stage_us: [240 + 60 * Math.random(), 60],
      },
    ];
  }

  #frame(stream, skeleton_id, pose, more) {
    const now = this.now_ns();
    const joints = pose.rotation_xyzw.length / 4;
    return [
      `pose/${stream}`,
      encode('Frame', {
        stream,
        sequence: this.frames,
        arrival_ns: String(now - 150000n),
        published_ns: String(now - 20000n),
        skeleton_id,
        ...pose,
        validity: new Uint8Array(joints).fill(1),
        ...more,
      }),
    ];
  }

  stats() {
    const common = (name, driver) => ({
      stream: name,
      driver,
      state: 'live',
      frames: this.frames,
      rate_hz: this.rate_hz,
      publish: { p50_us: 130, p99_us: 310, max_us: 420 },
    });
    const bodies = this.bodies.map((body) => ({
      ...common(body.name, 'file'),
      alpha: body.alpha,
      alpha_target: body.target,
      model: body.model,
      style_gate: 1,
      style_estimate: -0.05,
      stage: [
        {
          name: 'style',
          model: body.model,
          word: ['sway', 'march'],
          parameter: [
            { name: 'alpha', value: body.alpha, target: body.target },
            { name: 'gate', value: 1, target: 1 },
            { name: 'mask', text: body.mask },
            { name: 'weights', text: body.weights },
          ],
        },
        {
          name: 'feet',
          parameter: [
            { name: 'root', value: body.root, target: body.root },
            { name: 'limit_cm', value: body.limit_cm, target: body.limit_cm },
          ],
        },
      ],
    }));
    const hands = this.hands.map(({ name, model, labels }) => ({
      ...common(name, 'cyberglove'),
      lag_frames: 1,
      lag_ms: 1000 / this.rate_hz,
      device_info: 'cyberglove hand=right',
      connections: 1,
      clock_offset_ns: -4200000,
      clock_drift_ppm: 3.1,
      stage: [
        { name: 'generate', model, word: labels },
        { name: 'constrain' },
      ],
    }));
    return {
      time_ns: String(this.now_ns()),
      stream: [...bodies, ...hands],
      source: [
        {
          name: 'stage',
          driver: 'natnet',
          identity: '192.168.1.20:1510',
          outcome: [5200, 3, 0, 0, 0, 9],
          kernel_dropped: 12,
        },
        { name: 'phone', driver: 'mocopi', away: true },
      ],
      output: [
        {
          name: 'vmc-walker',
          kind: 'vmc',
          address: '127.0.0.1:39539',
          receivers: 1,
          frames: this.frames,
          sent: 1200,
        },
      ],
      cpu_percent: 9.9,
      rss_bytes: 29900000,
      replay_file: this.replay_file,
      recorder_file: this.recording ? 'take1.plog' : '',
      recorder_trouble: this.recorder_trouble,
      ...(this.take ? { take: this.take } : {}),
    };
  }

  // request: posed.v1.ControlRequest as an object; returns a ControlReply.
  answer(request) {
    const [kind] = Object.keys(request);
    const details = request[kind];
    const body = this.bodies.find(({ name }) => name === details.stream);
    const hand = this.hands.find(({ name }) => name === details.stream);
    const done = { ok: true, stream: details.stream ?? '', sequence: this.frames + 1 };
    if (kind === 'set_parameter' && body) return this.#set(body, details, done);
    if (kind === 'stage_command' && hand) return this.#command(hand, details, done);
    if (kind === 'take') return this.#mark(details);
    if (kind === 'teach' && hand) return { ok: true, teaching: this.#teachSigns(hand, details) };
    if (kind === 'teach' && body) return { ok: true, teaching: this.#teach(body, details) };
    if (kind === 'list_models') return { ok: true, model: this.models };
    if (kind === 'rename_model' || kind === 'delete_model') return this.#keep(kind, details);
    if (kind === 'list_recordings') return { ok: true, recording: this.recordings };
    if (kind === 'fetch_recording') {
      const { name, offset = 0, as = '', from_s, to_s } = details;
      const made = () => new TextEncoder().encode(`${as} from ${from_s} to ${to_s}`);
      const bytes = as ? made() : name.includes('-2-') ? TAKE : RECORDED;
      return { ok: true, piece: bytes.subarray(offset, offset + 32768) };
    }
    if (kind === 'use_model' && body) {
      body.model = details.name === 'none' ? '' : details.name;
      return done;
    }
    if (kind === 'model_part' && details.offset + details.bytes.length === details.total)
      return done;
    if (kind === 'model_part') return { ok: true };
    return { ok: false, error: `there is no stream "${details.stream}" that can do this` };
  }

  #keep(kind, { name, to }) {
    const model = this.models.find((one) => one.name === name);
    if (this.bodies.some((body) => body.model === name))
      return { ok: false, error: `'walker' uses it; give 'walker' another model, or none, first` };
    if (kind === 'delete_model') this.models = this.models.filter((one) => one !== model);
    else model.name = `${to}.style`;
    return { ok: true };
  }

  #set(body, { name, number, text, flag }, done) {
    const root = ROOTS.indexOf(text);
    if (name === 'style.alpha' && Math.abs(number) <= 2) body.target = number;
    else if (name === 'style.mask') body.mask = text;
    else if (name === 'style.weights') body.weights = text;
    else if (name === 'feet.limit_cm' && number > 0) body.limit_cm = number;
    else if (name === 'feet.root' && root >= 0) body.root = root;
    else if (name !== 'style.gate' || flag === undefined)
      return { ok: false, error: `${name}: give a number from -2 to 2` };
    return done;
  }

  // Each walk takes five questions, a training one; the first walk in the style is none.
  #teach(body, { stream, mark, train, cancel }) {
    this.teaching ??= { stream, step: 0 };
    const { teaching } = this;
    if (mark) {
      Object.assign(teaching, { step: 1, style: mark.style, seconds_left: mark.seconds });
      this.more = mark.more;
      const kind = mark.style ? 'style_walk' : 'neutral_walk';
      teaching[kind] = { takes: teaching[kind]?.takes ?? 0, sentence: 'so far: 4 strides' };
    } else if (train) Object.assign(teaching, { step: 3, model: `${train.name}.style` });
    else if (cancel) teaching.step = 0;
    else if (teaching.step === 3) {
      body.model = teaching.model;
      Object.assign(teaching, { step: 5, sequence: 900, train_s: 1.5, verdict: 'learnt 90 %' });
    } else if (teaching.step === 1 && (teaching.seconds_left -= 5) < 0) {
      const good = !teaching.style || this.stumbled === true;
      const sentence = good ? '18 strides in 20.0 s' : 'this is no walk';
      this.stumbled ||= teaching.style;
      teaching.step = 0;
      const kind = teaching.style ? 'style_walk' : 'neutral_walk';
      const before = this.more ? (teaching[kind]?.takes ?? 0) : 0;
      teaching[kind] = { good, sentence, takes: before + Number(good) };
    }
    return teaching;
  }

  // Each show takes three questions, a training one; the second show is refused.
  #teachSigns(hand, { stream, show, forget, train }) {
    this.lesson ??= { stream, step: 0, sign: [] };
    const { lesson } = this;
    if (show) Object.assign(lesson, { step: 1, label: show.label, seconds_left: show.seconds });
    else if (forget) lesson.sign = lesson.sign.filter(({ label }) => label !== forget.label);
    else if (train) Object.assign(lesson, { step: 3, model: `${train.name}.gesture` });
    else if (lesson.step === 3) {
      hand.model = lesson.model;
      hand.labels = ['rest', ...lesson.sign.map(({ label }) => label)];
      Object.assign(lesson, { step: 5, sequence: 900, train_s: 0.5, verdict: 'knows ok, rest' });
    } else if (lesson.step === 1 && (lesson.seconds_left -= 2) < 0) {
      this.shown = (this.shown ?? 0) + 1;
      const good = this.shown !== 2;
      lesson.step = 0;
      lesson.show = { good, sentence: good ? 'held within 2 degrees' : 'the hand moved too much' };
      const sign = lesson.sign.find(({ label }) => label === lesson.label);
      if (good && sign) sign.shows += 1;
      else if (good) lesson.sign.push({ label: lesson.label, shows: 1 });
    }
    return lesson;
  }

  #command(hand, { name, word, number }, done) {
    const unknown = word.find((label) => !(label in SIGNS));
    if (unknown !== undefined)
      return {
        ok: false,
        error: `the model does not know "${unknown}"; it knows ${Object.keys(SIGNS)}`,
      };
    hand.play = name === 'generate.play' ? word : [];
    hand.loop = number?.loop === 1;
    hand.began_s = this.time_s();
    return done;
  }

  #mark({ start, name }) {
    if (!this.recording) return { ok: false, error: 'the daemon does not record' };
    if (!start && !this.take) return { ok: false, error: 'no take is running' };
    if (start) this.takes += 1;
    const marked = start
      ? { number: this.takes, name, start_ns: String(this.now_ns()) }
      : this.take;
    this.take = start ? marked : null;
    return { ok: true, take: marked, recorder_trouble: this.recorder_trouble };
  }
}
