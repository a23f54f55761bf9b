// Hands, large, in a view of their own: upright, the palm to the viewer, as signs are read.
import { Group, PerspectiveCamera, Scene, Vector3 } from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { Lights } from './lights.js';
import { robotPlace } from './robot_shape.js';

const FIELD_DEG = 28;
const APART_M = { least: 0.2, most: 0.3 }; // from hand to hand, for their names
const HEIGHT_M = 0.29; // that is seen
const MIDDLE_M = 0.085; // of a hand, above its wrist

export class HandsView {
  scene = new Scene();
  camera = new PerspectiveCamera(FIELD_DEG, 1, 0.02, 10);
  #performers = new Map(); // name: {performer, holder}
  #free = 1; // share of the height that nothing covers
  #height = 1; // pixels
  #up = 0; // how far its middle is above that of the view, as a share

  constructor(element, theme, onChange) {
    this.lights = new Lights(theme, false);
    this.scene.add(this.lights.group);
    this.controls = new OrbitControls(this.camera, element);
    this.controls.enableDamping = true;
    this.controls.enablePan = false;
    this.controls.minDistance = 0.2;
    this.controls.maxDistance = 3;
    this.controls.addEventListener('change', onChange);
    this.setTheme(theme);
  }

  setTheme(theme) {
    this.scene.background = theme.hands;
    this.lights.setTheme(theme);
  }

  // Turns the hand upright: its fingers, along +Z with the palm down, point up; a robot's do. It is
  // held at the wrist: a hand's own place in the world counts for nothing here.
  add(performer) {
    const holder = new Group();
    const { group } = performer.figure;
    group.removeFromParent();
    const { stream } = performer;
    const robot = stream.isRobot ? robotPlace(stream.kinematics) : null;
    group.rotation.x = robot ? 0 : -Math.PI / 2;
    holder.scale.setScalar(robot?.scale ?? 1);
    holder.add(group);
    this.scene.add(holder);
    this.#performers.set(stream.name, { performer, holder, heel: robot?.heel });
  }

  remove(name) {
    this.#performers.get(name)?.holder.removeFromParent();
    this.#performers.delete(name);
  }

  // The shown hands beside each other; raw ones in the place of their twins, or beside them.
  arrange(names, placeOf) {
    const places = names.map(placeOf);
    const middle = (Math.min(...places) + Math.max(...places)) / 2;
    for (const [name, entry] of this.#performers) {
      const i = names.indexOf(name);
      entry.holder.visible = i >= 0;
      entry.place = i >= 0 ? places[i] - middle : 0;
    }
    const count = names.length ? 1 + Math.max(...places) - Math.min(...places) : 0;
    // Whoever turned the view keeps it.
    if (count === this.count) this.#spread();
    else {
      this.count = count;
      this.#frame();
    }
  }

  // top: pixels at the upper edge that buttons cover; bottom: at the lower one, for names.
  resize(width, height, top, bottom) {
    const aspect = width / Math.max(height, 1);
    const free = 1 - (top + bottom) / Math.max(height, 1);
    if (aspect === this.camera.aspect && free === this.#free) return;
    this.camera.aspect = aspect;
    this.#height = height;
    this.#free = free;
    this.#up = (0.5 * (bottom - top)) / Math.max(height, 1);
    this.camera.updateProjectionMatrix();
    this.#frame();
  }

  #spread() {
    for (const { holder, place = 0 } of this.#performers.values())
      holder.position.x = place * this.apart_m;
  }

  #frame() {
    const half = Math.tan((FIELD_DEG * Math.PI) / 360);
    const count = this.count ?? 1;
    const across_m = count * APART_M.least + 0.06;
    const high_m = Math.max(
      HEIGHT_M / Math.max(this.#free, 0.3),
      across_m / Math.max(this.camera.aspect, 0.2),
    );
    const far = high_m / (2 * half);
    const { least, most } = APART_M;
    this.apart_m = Math.min(Math.max((high_m * this.camera.aspect) / count, least), most);
    this.apart_px = (this.apart_m * this.#height) / high_m;
    this.#spread();
    this.controls.target.set(0, MIDDLE_M - this.#up * high_m, 0);
    this.camera.position
      .set(0.3, 0.11, 1)
      .normalize()
      .multiplyScalar(far)
      .add(this.controls.target);
    this.controls.update();
  }

  // Holds the wrist still, and gives the point below it for its name.
  hold(performer, point) {
    const entry = this.#performers.get(performer.stream.name);
    const { kinematics } = performer.stream;
    const i = 3 * kinematics.root;
    const { group } = performer.figure;
    wrist.fromArray(kinematics.position, i).applyEuler(group.rotation);
    group.position.copy(wrist).negate();
    if (entry.heel) group.position.sub(heel.fromArray(entry.heel));
    point.copy(entry.holder.position);
    point.y -= 0.04;
  }
}

const wrist = new Vector3();
const heel = new Vector3();
