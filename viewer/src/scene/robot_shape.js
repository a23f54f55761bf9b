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

// The joints whose links stopped it just now.
export function stoppedJoints(kinematics, stats) {
  const names = [stats?.robot_stop_joint, stats?.robot_stop_other].filter(Boolean);
  return names.map((name) => kinematics.names.indexOf(name)).filter((joint) => joint >= 0);
}
