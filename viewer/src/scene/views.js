// The camera: with the chosen body, turning round it, or with everybody from the front, the side or
// above. It glides, never cuts.
import { PerspectiveCamera, Vector3 } from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';

export const VIEWS = ['follow', 'orbit', 'front', 'side', 'top'];

const FIELD_DEG = 34;
const TURNS_PER_MIN = 1.5; // of orbit
const DIRECTIONS = {
  orbit: [0.62, 0.3, 1],
  follow: [0.62, 0.3, 1],
  front: [0, 0.12, 1],
  side: [1, 0.12, 0.001],
  top: [0, 1, 0.001],
};
const GLIDE_S = 0.13; // time constant of the way to the figures
const BACK_S = 0.8; // the same of the way back from where a person shifted the view
const LONGEST_S = 0.25; // between two pictures, for the glide
const HALF_HIGH_M = 0.95; // half of a body's height, with room
const LEAST_M = 1.2; // half of what is seen across, at least
const BESIDE_M = 0.75; // room beside the outermost hips

export class Views {
  camera = new PerspectiveCamera(FIELD_DEG, 1, 0.05, 120);
  name = 'follow';
  #centre = new Vector3(0, 0.9, 0); // where the figures are, smoothed
  #row_m = 0; // half of the width of the figures' row, and of its length along their way
  #way_m = 0;
  // Of both the shares that this view has across, and of a metre what it sees downwards and flat.
  #seen = { row: 1, way: 0, down: 0, flat: 1 };
  #far_m = 0; // distance that is aimed at; 0: as the person left it
  #settled = false;
  #last_s = NaN;
  #free = { wide: 1, high: 1 }; // the part that is not covered, in heights of the picture
  #yaw = 0; // where the figures face

  // turns: whether orbit turns by itself, which not everybody bears
  constructor(element, onChange, turns = true) {
    this.turns = turns;
    this.controls = new OrbitControls(this.camera, element);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.12;
    this.controls.maxPolarAngle = 0.5 * Math.PI - 0.02;
    this.controls.minDistance = 0.6;
    this.controls.maxDistance = 40;
    this.controls.target.copy(this.#centre);
    this.onChange = onChange;
    // Who takes the camera in hand keeps it: from the fixed views it goes on from there, following.
    this.controls.addEventListener('start', () => {
      this.#far_m = 0;
      this.controls.autoRotate = false;
      if (this.name !== 'orbit' && this.name !== 'follow') this.#become('follow');
    });
    this.#turnTo('follow');
  }

  set(name) {
    if (!VIEWS.includes(name)) return;
    this.#become(name);
    this.controls.autoRotate = name === 'orbit' && this.turns;
    this.controls.autoRotateSpeed = TURNS_PER_MIN;
    this.#turnTo(name);
  }

  // Whether it looks at one body, not at everybody.
  get isOfOne() {
    return this.name === 'orbit' || this.name === 'follow';
  }

  // The figures face another way, in radians about Y from +Z.
  face(yaw) {
    if (yaw === this.#yaw) return;
    this.#yaw = yaw;
    this.#turnTo(this.name);
  }

  #become(name) {
    this.name = name;
    this.onChange(name);
  }

  #turnTo(name) {
    const direction = new Vector3(...DIRECTIONS[name]).normalize();
    const flat = Math.hypot(direction.x, direction.z);
    this.#seen = { row: direction.z / flat, way: direction.x / flat, down: direction.y, flat };
    if (name === 'orbit') Object.assign(this.#seen, { row: 1, way: 1 }); // in turn
    direction.applyAxisAngle(UP, this.#yaw);
    this.#far_m = this.#fitting();
    this.camera.position.copy(this.controls.target).addScaledVector(direction, this.#far_m);
  }

  // So far away that all figures are seen.
  #fitting() {
    const half = Math.tan((FIELD_DEG * Math.PI) / 360);
    const { wide, high } = this.#free;
    const { row, way, down, flat } = this.#seen;
    const across_m = Math.max(this.#row_m * row + this.#way_m * way + BESIDE_M, LEAST_M);
    const nearest_m = this.#row_m * way + this.#way_m * row; // of them, before the middle
    const up_m = HALF_HIGH_M * flat + (nearest_m + 0.5 * BESIDE_M) * down;
    const far_m = Math.max(across_m / Math.max(wide, 0.2), up_m / Math.max(high, 0.2)) / half;
    return far_m + nearest_m * flat;
  }

  // covered: {right, bottom, top}; what is looked at is in the middle of the rest.
  resize(width, height, { right, bottom, top }) {
    this.camera.aspect = width / Math.max(height, 1);
    this.#free = {
      wide: (width - right) / Math.max(height, 1),
      high: 1 - (bottom + top) / Math.max(height, 1),
    };
    this.camera.setViewOffset(width, height, right / 2, (bottom - top) / 2, width, height);
    if (this.#far_m > 0) this.#far_m = this.#fitting();
  }

  // centre: of all figures; extent: {row_m, way_m}, how far they stand from it, across and along
  // their way; jumped: the clip began again; now_s: by it the view glides equally fast however many
  // pictures a second there are.
  update(centre, { row_m, way_m }, jumped, now_s) {
    const far = !this.#settled || jumped;
    const passed_s = Math.min(now_s - this.#last_s || 0, LONGEST_S);
    this.#settled = true;
    this.#last_s = now_s;
    if (Math.abs(row_m - this.#row_m) > 0.2 || Math.abs(way_m - this.#way_m) > 0.2) {
      this.#row_m = row_m;
      this.#way_m = way_m;
      if (this.#far_m > 0) this.#far_m = this.#fitting();
    }
    this.#follow(centre, far, passed_s);
    this.controls.update(passed_s);
  }

  #follow(centre, far, passed_s) {
    const { target } = this.controls;
    const glide = shareOf(passed_s, GLIDE_S);
    shift
      .copy(centre)
      .sub(this.#centre)
      .multiplyScalar(far ? 1 : glide);
    this.#centre.add(shift);
    target.add(shift);
    this.camera.position.add(shift);
    // What was shifted by hand glides back to the figures.
    shift.copy(this.#centre).sub(target).multiplyScalar(shareOf(passed_s, BACK_S));
    target.add(shift);
    this.camera.position.add(shift);
    if (this.#far_m === 0) return;
    shift.copy(this.camera.position).sub(target);
    const length = shift.length();
    shift.setLength(length + glide * (this.#far_m - length));
    this.camera.position.copy(target).add(shift);
  }

  get target() {
    return this.controls.target;
  }
}

// The share of the way that is gone in this time.
const shareOf = (passed_s, constant_s) => 1 - Math.exp(-passed_s / constant_s);

const shift = new Vector3();
const UP = new Vector3(0, 1, 0);
