// Where the feet are, how fast, and whether they stand: from the poses alone.

const LOW_M = 0.05; // above the lowest that a foot was lately
const SLOW_M_PER_S = 0.45;
const LEVEL_RISE_M_PER_S = 0.02; // how fast the lowest level is forgotten
const JUMP_M = 0.6; // farther in one frame: the clip began again

export class Foot {
  point = new Float32Array(3); // its toes [m]
  speed_m_per_s = 0;
  stands = false;
  jumped = false;
  #last = new Float32Array(3);
  #time_ms = NaN;
  #level = Infinity;

  // foot, toes: joints; toes may be -1. Then the tip of the foot counts, and without one the ankle.
  constructor(foot, toes) {
    this.joint = toes >= 0 ? toes : foot;
    this.hasToes = toes >= 0;
  }

  update(kinematics, time_ms) {
    const { point } = this;
    if (this.hasToes || !kinematics.tipOf(this.joint, point, 0)) {
      for (let i = 0; i < 3; i += 1) point[i] = kinematics.position[3 * this.joint + i];
    }
    const passed_s = (time_ms - this.#time_ms) / 1000;
    if (passed_s === 0) return;
    const moved = distance(point, this.#last);
    this.jumped = passed_s < 0 || moved > JUMP_M; // times go back when a recording begins again
    if (passed_s < 0.5 && !this.jumped) {
      this.speed_m_per_s += 0.5 * (moved / passed_s - this.speed_m_per_s);
      this.#level = Math.min(point[1], this.#level + LEVEL_RISE_M_PER_S * passed_s);
    } else {
      this.#level = Math.min(point[1], this.jumped ? this.#level : Infinity);
      this.speed_m_per_s = 0;
    }
    this.stands = point[1] - this.#level < LOW_M && this.speed_m_per_s < SLOW_M_PER_S;
    this.#last.set(point);
    this.#time_ms = time_ms;
  }
}

// The figure's feet, left first; none where it has no such bones.
export function feetOf(kinematics) {
  return ['left', 'right']
    .map((side) => [kinematics.jointOf(`${side}Foot`), kinematics.jointOf(`${side}Toes`)])
    .filter(([foot]) => foot >= 0)
    .map(([foot, toes]) => new Foot(foot, toes));
}

const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
