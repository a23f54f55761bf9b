// The shape of a robot: the capsules by which posed keeps its links apart.
import { COARSE, Mesh, addCapsule } from './capsule.js';

// As bodyShape().
export function robotShape(kinematics) {
  const mesh = new Mesh(COARSE); // there may be hundreds
  for (const { joint, from, to, radius } of kinematics.capsules)
    addCapsule(mesh, from, to, radius, radius, joint);
  return {
    position: Float32Array.from(mesh.position),
    normal: Float32Array.from(mesh.normal),
    index: mesh.index,
    owner: Uint16Array.from(mesh.owner),
    scale: 1,
  };
}

const HAND_M = 0.2; // from heel to tip, as a person's

// How a robot hand stands beside a person's: as long, on its heel. `heel`: from the root, with all
// joints at zero.
export function robotPlace(kinematics) {
  const places = kinematics.restPositions();
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (const { joint, from, to, radius } of kinematics.capsules) {
    for (const end of [from, to]) {
      end.forEach((value, k) => {
        const at = places[3 * joint + k] - places[3 * kinematics.root + k] + value;
        low[k] = Math.min(low[k], at - radius);
        high[k] = Math.max(high[k], at + radius);
      });
    }
  }
  return {
    heel: [(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2],
    scale: HAND_M / Math.max(high[1] - low[1], 1e-3),
  };
}

// The joints whose links stopped it just now.
export function stoppedJoints(kinematics, stats) {
  const names = [stats?.robot_stop_joint, stats?.robot_stop_other].filter(Boolean);
  return names.map((name) => kinematics.names.indexOf(name)).filter((joint) => joint >= 0);
}
