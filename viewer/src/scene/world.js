// The scene: who is in it, where they stand, and one picture per animation frame. Two views share
// one canvas: the bodies, and the hands in an inset.
import { Scene, Vector3 } from 'three';
import { LANE_M, lanesOf } from './lanes.js';
import { COARSE, FINE } from './capsule.js';
import { Ground } from './ground.js';
import { HandsView } from './hands_view.js';
import { Lights } from './lights.js';
import { NameTags } from './name_tags.js';
import { COARSEST, FINEST, Pace } from './pace.js';
import { Performer } from './performer.js';
import { Views } from './views.js';
import { makeRenderer } from './renderer.js';
import { sceneColours } from './palette.js';
import { facing } from './facing.js';
import { RAW_SUFFIX } from '../streams/stream.js';

const MOST_PIXELS = 2; // per CSS pixel
const NAMES_PX = 44; // of the bodies, below the buttons
const HAND_NAMES_PX = 66; // of hands, four lines
const GAP_PX = 8; // between what covers the bodies and them
const BESIDE_M = 3;
const CROWD = 4; // figures; of more only the styled ones have names
const CALM_FRAMES = 90; // drawn after the last change, while the camera glides
const EASED = 4; // the page's frames for a picture, where the processor finds hands, too

export class World {
  performers = new Map();
  options = {
    raw: 'beside',
    trails: true,
    floor: true,
    names: true,
    background: 'page', // or a name of sceneColours()
    quality: 'auto', // or 'sharp', 'quick'
  };
  #dirty = CALM_FRAMES;
  #yaw = null;
  #numbers = new Map(); // of the performers' colours, by name
  #chosen = null; // the stream whose body follow and orbit look at
  #pace = new Pace();
  #waited = 0; // frames since the last picture
  #eased = false;
  #areas = { bodies: null, hands: null };
  #wanted = []; // who waits for a picture
  #tools_px = 0; // at the top of the scene, covered by the buttons
  #arranged = ''; // the streams of the last statistics that moved somebody

  // stage: the element with the canvas, the hands' inset and the names' layer.
  constructor(stage, store, theme) {
    this.stage = stage;
    this.store = store;
    this.canvas = stage.querySelector('canvas');
    this.inset = stage.querySelector('.hands');
    this.tools = stage.querySelector('.tools');
    this.legend = stage.querySelector('.legend');
    Object.assign(this, makeRenderer(this.canvas));
    this.theme = sceneColours(theme);
    this.scene = new Scene();
    this.ground = new Ground(this.theme);
    this.lights = new Lights(this.theme, true);
    this.scene.add(this.ground.group, this.lights.group);
    const turns = !matchMedia('(prefers-reduced-motion: reduce)').matches;
    this.views = new Views(this.canvas, (name) => this.onView?.(name), turns);
    this.views.controls.addEventListener('change', () => this.touch());
    this.hands = new HandsView(this.inset.querySelector('.hands-area'), this.theme, () =>
      this.touch(),
    );
    this.tags = new NameTags(stage.querySelector('.name-tags'));
    this.setTheme(theme);
    const sizes = new ResizeObserver(() => this.resize());
    for (const element of [stage, this.tools, this.legend]) sizes.observe(element);
    store.addEventListener('skeleton', ({ detail }) => this.#enter(detail));
    store.addEventListener('gone', ({ detail }) => this.#leave(detail.name));
    store.addEventListener('stats', () => this.#arrangeChanged());
  }

  touch() {
    this.#dirty = CALM_FRAMES;
  }

  setTheme(name) {
    this.themeName = name;
    this.theme = sceneColours(name, this.options.background);
    this.scene.background = this.theme.background;
    for (const part of [this.ground, this.lights, this.hands, ...this.performers.values()])
      part.setTheme(this.theme);
    this.touch();
  }

  setOption(name, value) {
    this.options[name] = value;
    const { floor, names, background } = this.options;
    this.stage.dataset.names = names ? 'on' : 'off';
    // Its lines are not of the one colour that is cut out.
    this.ground.group.visible = floor && background !== 'green';
    if (name === 'background') this.setTheme(this.themeName);
    if (name === 'quality') this.resize();
    this.arrange();
  }

  #enter(stream) {
    this.#leave(stream.name);
    const detail = this.fine ? FINE : COARSE;
    const number = this.#numberOf(stream);
    const performer = new Performer(stream, this.scene, this.theme, detail, number);
    this.performers.set(stream.name, performer);
    if (stream.isHand) this.hands.add(performer);
    this.arrange();
  }

  // A colour stays with its name; a new one gets the first that nobody has.
  #numberOf({ name, isRaw }) {
    if (isRaw) return 0;
    if (!this.#numbers.has(name)) {
      for (const other of this.#numbers.keys())
        if (!this.store.streams.has(other)) this.#numbers.delete(other);
      const taken = new Set(this.#numbers.values());
      let number = 0;
      while (taken.has(number)) number += 1;
      this.#numbers.set(name, number);
    }
    return this.#numbers.get(name);
  }

  // Skeletons come before the first statistics, in any order.
  #numberInOrder() {
    this.#numbers.clear();
    for (const stream of this.store.main()) {
      const number = this.#numberOf(stream);
      const performer = this.performers.get(stream.name);
      if (performer) performer.figure.number = number;
    }
    for (const performer of this.performers.values()) performer.setTheme(this.theme);
  }

  // Whom follow and orbit keep in the picture; everybody where it is no body.
  choose(name) {
    if (this.#chosen === name) return;
    this.#chosen = name;
    this.touch();
  }

  // Whether the view looks at this performer: of follow and orbit the chosen body, its raw twin and
  // what is played beside it, where it is near: else it would make the chosen one small.
  #isLookedAt(performer) {
    const { stream, figure } = performer;
    if (stream.isHand || !figure.group.visible) return false;
    const one = this.performers.get(this.#chosen);
    if (!this.views.isOfOne || !one || one.stream.isHand) return true;
    if (stream.isTake) return performer.centre.distanceTo(one.centre) < BESIDE_M;
    return stream.name === this.#chosen || stream.name === `${this.#chosen}${RAW_SUFFIX}`;
  }

  #leave(name) {
    const performer = this.performers.get(name);
    if (!performer) return;
    if (performer.stream.isHand) this.hands.remove(name);
    this.performers.delete(name);
    performer.dispose();
    this.tags.remove(name);
    this.arrange();
  }

  // Statistics come each second; only other streams or devices in them move anybody. Without this
  // the scene would never rest.
  #arrangeChanged() {
    const streams = this.store.main().map((one) => [one.name, one.stats.source_name, one.hasLeft]);
    const now = JSON.stringify(streams);
    if (now === this.#arranged) return;
    if (this.#arranged === '') this.#numberInOrder();
    this.#arranged = now;
    this.arrange();
  }

  // Who stands where; after each change of streams or options.
  arrange() {
    this.touch();
    const { raw } = this.options;
    const mains = this.store.shown().filter(({ name }) => this.performers.has(name));
    const twin = (stream) => this.performers.get(`${stream.name}-raw`);
    const bodies = mains.filter(({ isHand }) => !isHand);
    const hands = mains.filter(({ isHand, hasLeft }) => isHand && !hasLeft);
    const lanes = lanesOf(bodies, (stream) => raw === 'beside' && twin(stream) !== undefined);
    for (const stream of bodies) {
      const place = lanes.get(stream.name);
      this.#stand(this.performers.get(stream.name), place.styled, true);
      this.#stand(twin(stream), raw === 'beside' ? place.raw : place.styled, raw !== 'off');
    }
    this.#arrangeHands(hands, twin);
    this.#show(bodies.length > 0, hands.length > 0);
  }

  #stand(performer, lane, shown) {
    if (!performer) return;
    const yaw = this.#yaw ?? 0;
    performer.standIn(lane * LANE_M * Math.cos(yaw), -lane * LANE_M * Math.sin(yaw));
    performer.shown = shown;
    performer.figure.group.visible = shown && performer.stream.drawable;
    if (!shown) this.tags.hide(performer.stream.name);
  }

  #arrangeHands(hands, twin) {
    const places = new Map();
    let next = 0;
    for (const stream of hands) {
      const raw = this.options.raw === 'off' ? undefined : twin(stream);
      if (raw) places.set(raw.stream.name, next);
      if (raw && this.options.raw === 'beside') next += 1;
      places.set(stream.name, next);
      next += 1;
    }
    for (const { stream } of [...this.performers.values()].filter((one) => one.stream.isHand)) {
      this.performers.get(stream.name).shown = places.has(stream.name);
      if (!places.has(stream.name)) this.tags.hide(stream.name);
    }
    this.hands.arrange([...places.keys()], (name) => places.get(name));
  }

  #show(bodies, hands) {
    const show = bodies && hands ? 'both' : (hands && 'hands') || (bodies && 'bodies') || 'none';
    if (this.stage.dataset.show === show) return;
    this.stage.dataset.show = show;
    this.resize();
  }

  // While the processor has more to do than to draw: without a graphics card it draws coarser and
  // less often.
  ease(eased) {
    if (this.fine || eased === this.#eased) return;
    this.#eased = eased;
    this.resize();
  }

  get #detail() {
    const { quality } = this.options;
    if (this.#eased || quality === 'quick') return COARSEST;
    return quality === 'sharp' ? FINEST : this.#pace.now;
  }

  resize() {
    const { width, height } = this.stage.getBoundingClientRect();
    if (width === 0) return;
    const { pixels, shadows } = this.#detail;
    this.renderer.setPixelRatio(pixels * Math.min(devicePixelRatio, MOST_PIXELS));
    this.lights.sun.castShadow = shadows;
    this.ground.setShadows(shadows);
    this.renderer.setSize(width, height, false);
    this.#tools_px = this.tools.offsetTop + this.tools.offsetHeight + GAP_PX;
    this.#areas.bodies = { left: 0, top: 0, width, height, covered: this.#tools_px };
    const show = this.stage.dataset.show;
    this.#areas.hands = show === 'both' || show === 'hands' ? this.#insetArea() : null;
    this.views.resize(width, height, this.#covered());
    if (this.#areas.hands) {
      const { width: wide, height: high } = this.#areas.hands;
      this.hands.resize(wide, high, show === 'hands' ? this.#tools_px : 0, HAND_NAMES_PX);
    }
    this.touch();
  }

  // What inset, names and legend take from the bodies, in CSS pixels: they stand beside the inset, or
  // above it where it is as wide as the scene, and always above the legend.
  #covered() {
    const { bodies, hands } = this.#areas;
    const beside = hands && this.stage.dataset.show === 'both' && hands.width < 0.7 * bodies.width;
    return {
      right: beside ? bodies.width - hands.left : 0,
      bottom: bodies.height - this.legend.offsetTop + GAP_PX,
      top: this.#tools_px + NAMES_PX,
    };
  }

  #insetArea() {
    const outer = this.stage.getBoundingClientRect();
    const { left, top, width, height } = this.inset
      .querySelector('.hands-area')
      .getBoundingClientRect();
    const covered = this.stage.dataset.show === 'hands' ? this.#tools_px : 0;
    return { left: left - outer.left, top: top - outer.top, width, height, covered };
  }

  // A PNG of the next picture, which is drawn for it.
  picture() {
    this.touch();
    return new Promise((done) => {
      this.#wanted.push(done);
    });
  }

  // Shows the newest poses. shown(performer) is called for each that is new. Returns whether
  // anything was drawn.
  frame(shown) {
    this.#update(shown);
    this.#waited += 1;
    const early = this.#eased && this.#waited < EASED;
    if (this.#dirty === 0 || this.stage.dataset.show === 'none' || early) {
      this.#pace.rest();
      return false;
    }
    this.#waited = 0;
    this.#dirty -= 1;
    this.#look();
    this.#draw();
    // At once: what was drawn is gone after this task.
    for (const done of this.#wanted.splice(0)) this.canvas.toBlob(done, 'image/png');
    if (!this.fine && this.#pace.drawn(performance.now())) this.resize();
    return true;
  }

  #update(shown) {
    for (const performer of this.performers.values()) {
      if (!performer.update(this.options.trails)) continue;
      this.touch();
      performer.figure.group.visible = performer.shown !== false;
      if (this.#yaw === null && !performer.ghost && performer.stream.isHand === false)
        this.#face(performer);
      shown(performer);
    }
    this.#keepTwinsNear();
  }

  // A style with a pace of its own leaves the raw figure behind, or ahead: after minutes it would
  // be out of sight.
  #keepTwinsNear() {
    for (const performer of this.performers.values()) {
      const { name, isRaw, isHand } = performer.stream;
      const styled = isRaw && !isHand && this.performers.get(name.slice(0, -RAW_SUFFIX.length));
      if (styled) performer.keepNear(styled, BESIDE_M);
    }
  }

  // Lanes lie across the first body's way, whichever axis its world has there.
  #face(performer) {
    this.#yaw = facing(performer.stream.kinematics);
    this.views.face(this.#yaw);
    this.arrange();
  }

  #look() {
    let [count, jumped] = [0, false];
    middle.set(0, 0, 0);
    for (const performer of this.performers.values()) {
      if (!this.#isLookedAt(performer)) continue;
      middle.add(performer.centre);
      count += 1;
      jumped ||= performer.jumped;
    }
    if (count > 0) middle.divideScalar(count);
    const [c, s] = [Math.cos(this.#yaw ?? 0), Math.sin(this.#yaw ?? 0)];
    extent.row_m = 0;
    extent.way_m = 0;
    for (const performer of this.performers.values()) {
      if (!this.#isLookedAt(performer)) continue;
      const [x, z] = [performer.centre.x - middle.x, performer.centre.z - middle.z];
      extent.row_m = Math.max(extent.row_m, Math.abs(c * x - s * z));
      extent.way_m = Math.max(extent.way_m, Math.abs(s * x + c * z));
    }
    if (count > 0) this.views.update(middle, extent, jumped, performance.now() / 1000);
    this.ground.follow(this.views.target);
    this.lights.follow(this.views.target);
  }

  #draw() {
    const { bodies, hands } = this.#areas;
    const show = this.stage.dataset.show;
    if (bodies && show !== 'hands')
      this.#render(this.scene, this.views.camera, bodies, bodies.height);
    if (hands) {
      this.hands.controls.update();
      this.#render(this.hands.scene, this.hands.camera, hands, bodies.height);
    }
    this.tags.begin();
    const standing = [...this.performers.values()].filter(
      ({ stream, figure }) => !stream.isHand && figure.group.visible,
    );
    for (const body of standing) body.findTop(this.views.camera);
    for (const performer of this.performers.values()) this.#tag(performer, standing);
  }

  #render(scene, camera, { left, top, width, height }, whole) {
    const bottom = whole - top - height;
    this.renderer.setViewport(left, bottom, width, height);
    this.renderer.setScissor(left, bottom, width, height);
    this.renderer.render(scene, camera);
  }

  #tag(performer, bodies) {
    if (!performer.figure.group.visible) return;
    const { name, isHand } = performer.stream;
    if (performer.ghost && this.performers.size > CROWD) {
      this.tags.hide(name); // the colour says it, and names would cover each other
      return;
    }
    if (isHand) {
      this.hands.hold(performer, at);
      at.project(this.hands.camera);
      const area = this.#areas.hands ?? this.#areas.bodies;
      this.tags.limit(name, Math.floor(this.hands.apart_px) - GAP_PX);
      this.tags.place(name, at, area, true);
    } else {
      at.copy(performer.above);
      const half = this.tags.widthOf(name) / this.#areas.bodies.width; // of -1 to 1
      for (const { above, head } of bodies)
        if (Math.abs(head.middle - at.x) < half + head.half && isNear(above, at))
          at.y = Math.max(at.y, above.y); // nobody's head is covered
      this.tags.place(name, at, this.#areas.bodies);
    }
  }
}

// Of a crowd in the distance each name stays with its own.
const isNear = (a, b) => Math.abs(a.y - b.y) < 0.3;

const middle = new Vector3();
const at = new Vector3();
const extent = { row_m: 0, way_m: 0 };
