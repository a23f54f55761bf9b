// Which way a body faces: the turn about Y from +Z, to the nearest quarter.
import { rotate } from '../motion/quaternion.js';

const FRONT = [0, 0, 1];

export function facing(kinematics) {
  const hips = kinematics.jointOf('hips');
  if (hips < 0) return 0;
  const front = [0, 0, 0];
  rotate(front, 0, kinematics.humanoidLocals(), 4 * hips, FRONT, 0);
  const quarter = Math.PI / 2;
  return Math.round(Math.atan2(front[0], front[2]) / quarter) * quarter;
}
