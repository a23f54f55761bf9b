// The shape of a figure: capsules from joint to joint, as thick as the bones that they stand for.
// Built in the T-pose, then moved into each joint's own frame, so that a pose only moves joints.
import { invert, rotate } from '../motion/quaternion.js';
import { isHand } from '../motion/body_parts.js';
import { FINE, Mesh, addCapsule } from './capsule.js';
import { robotShape } from './robot_shape.js';

const USUAL_HEIGHT_M = 1.7;
const USUAL_HAND_M = 0.19; // from the wrist to the tip of the longest finger
const TRUNK_DEPTH = 0.68;
const SHORT_M = 1e-3;

// Radii [m] of a person of usual height, at the bone's own joint.
const RADII = [
  [/^hips$/, 0.118],
  [/^spine$/, 0.112],
  [/^chest$/, 0.132],
  [/^upperChest$/, 0.13],
  [/^neck$/, 0.048],
  [/^head$/, 0.055],
  [/Shoulder$/, 0.062],
  [/UpperArm$/, 0.05],
  [/LowerArm$/, 0.04],
  [/Hand$/, 0.032],
  [/UpperLeg$/, 0.078],
  [/LowerLeg$/, 0.056],
  [/Foot$/, 0.042],
  [/Toes$/, 0.034],
  [/Thumb/, 0.0115],
  [/Little/, 0.0085],
  [/(Index|Middle|Ring)/, 0.0098],
];
const TRUNK = /^(hips|spine|chest|upperChest)$/;

const radiusOf = (bone) => RADII.find(([name]) => name.test(bone))?.[1] ?? 0;
const place = (places, joint) => [...places.subarray(3 * joint, 3 * joint + 3)];

// How large the figure is beside a usual one.
function scaleOf(kinematics, places) {
  if (isHand(kinematics)) {
    const wrist = place(places, kinematics.root);
    let reach = 0;
    for (let joint = 0; joint < kinematics.count; joint += 1) {
      const end = tipInRest(kinematics, places, joint) ?? place(places, joint);
      reach = Math.max(reach, Math.hypot(...end.map((value, k) => value - wrist[k])));
    }
    return reach / USUAL_HAND_M || 1;
  }
  let [low, high] = [Infinity, -Infinity];
  for (let joint = 0; joint < kinematics.count; joint += 1) {
    const end = tipInRest(kinematics, places, joint) ?? place(places, joint);
    low = Math.min(low, end[1]);
    high = Math.max(high, end[1]);
  }
  return (high - low) / USUAL_HEIGHT_M || 1;
}

function tipInRest({ tip, rest }, places, joint) {
  if (Number.isNaN(tip[3 * joint])) return null;
  const end = [0, 0, 0];
  rotate(end, 0, rest, 4 * joint, tip, 3 * joint);
  return end.map((value, k) => value + places[3 * joint + k]);
}

class Builder {
  constructor(kinematics, detail) {
    this.kinematics = kinematics;
    this.places = kinematics.restPositions();
    this.scale = scaleOf(kinematics, this.places);
    this.mesh = new Mesh(detail);
    this.bones = kinematics.bones;
  }

  // A joint that is no known bone is as thick as its length suggests.
  radius(joint, length_m) {
    const known = radiusOf(this.bones[joint]) * this.scale;
    return known || Math.min(Math.max(0.14 * length_m, 0.008), 0.06 * this.scale);
  }

  limb(joint, to, end_m) {
    const from = place(this.places, joint);
    const length_m = Math.hypot(...to.map((value, k) => value - from[k]));
    if (length_m < SHORT_M) return;
    const flat = TRUNK.test(this.bones[joint]) ? TRUNK_DEPTH : 1;
    addCapsule(this.mesh, from, to, this.radius(joint, length_m), end_m, joint, flat);
  }

  // From a joint to one of its children. The trunk is thick along the spine only: its branches to
  // neck and shoulders are as thin as these.
  bone(joint, child) {
    const to = place(this.places, child);
    const from = place(this.places, joint);
    const length_m = Math.hypot(...to.map((value, k) => value - from[k]));
    if (length_m < SHORT_M) return;
    const end_m = this.radius(child, length_m);
    const branches = TRUNK.test(this.bones[joint]) && !TRUNK.test(this.bones[child]);
    if (!branches) {
      this.limb(joint, to, end_m);
      return;
    }
    addCapsule(this.mesh, from, to, end_m, end_m, joint);
    if (this.bones[child] !== 'neck') return;
    const collar = to.map((value, k) => from[k] + 0.7 * (value - from[k]));
    const start_m = 1.05 * this.radius(joint, length_m); // over the capsule from below
    addCapsule(this.mesh, from, collar, start_m, 0.88 * start_m, joint, TRUNK_DEPTH);
  }

  // The end of a leaf: fingertips, toes; the head as a ball.
  tip(joint) {
    const end = tipInRest(this.kinematics, this.places, joint);
    const from = place(this.places, joint);
    if (this.bones[joint] === 'head') {
      const size = 0.098 * this.scale;
      const top = end ?? [from[0], from[1] + 0.18 * this.scale, from[2]];
      const low = from.map((value, k) => value + 0.38 * (top[k] - value));
      const high = from.map((value, k) => value + 0.62 * (top[k] - value));
      addCapsule(this.mesh, low, high, 0.9 * size, size, joint);
      addCapsule(this.mesh, from, low, 0.5 * size, 0.55 * size, joint);
      return;
    }
    const thin = 0.82 * this.radius(joint, 0.1);
    if (end) this.limb(joint, end, thin);
    else addCapsule(this.mesh, from, from, thin, thin, joint);
  }

  // The palm: from the wrist to each finger, and across the knuckles.
  palm(wrist) {
    const first = [];
    for (let joint = 0; joint < this.bones.length; joint += 1) {
      if (this.kinematics.parent[joint] === wrist && /Proximal/.test(this.bones[joint]))
        first.push(joint);
    }
    const thick = 0.0125 * this.scale;
    const from = place(this.places, wrist);
    for (const [i, joint] of first.entries()) {
      const to = place(this.places, joint);
      addCapsule(this.mesh, from, to, 1.5 * thick, 0.95 * thick, wrist);
      if (i === 0) continue;
      const before = place(this.places, first[i - 1]);
      addCapsule(this.mesh, before, to, 0.95 * thick, 0.95 * thick, wrist);
      const middle = (a) => a.map((value, k) => 0.45 * value + 0.55 * from[k]);
      addCapsule(this.mesh, middle(before), middle(to), thick, thick, wrist);
    }
  }

  isPalm(joint, child) {
    return (
      /(Proximal|Metacarpal)/.test(this.bones[child]) &&
      !/Thumb|Index|Middle|Ring|Little/.test(this.bones[joint])
    );
  }

  build() {
    const { parent, count } = this.kinematics;
    const palms = new Set();
    const hasChild = new Uint8Array(count);
    for (let joint = 0; joint < count; joint += 1) {
      const above = parent[joint];
      if (above < 0) continue;
      hasChild[above] = 1;
      if (this.isPalm(above, joint) && !/Thumb/.test(this.bones[joint])) palms.add(above);
      else this.bone(above, joint);
    }
    for (let joint = 0; joint < count; joint += 1) if (!hasChild[joint]) this.tip(joint);
    for (const wrist of palms) this.palm(wrist);
    return this.mesh;
  }
}

// Flat arrays of the figure's mesh; each vertex is in the frame of its joint.
export function bodyShape(kinematics, detail = FINE) {
  if (kinematics.capsules.length > 0) return robotShape(kinematics);
  const builder = new Builder(kinematics, detail);
  const mesh = builder.build();
  const position = Float32Array.from(mesh.position);
  const normal = Float32Array.from(mesh.normal);
  const back = new Float32Array(4 * kinematics.count);
  for (let joint = 0; joint < kinematics.count; joint += 1)
    invert(back, 4 * joint, kinematics.rest, 4 * joint);
  mesh.owner.forEach((joint, i) => {
    for (let k = 0; k < 3; k += 1) position[3 * i + k] -= builder.places[3 * joint + k];
    rotate(position, 3 * i, back, 4 * joint, position, 3 * i);
    rotate(normal, 3 * i, back, 4 * joint, normal, 3 * i);
  });
  return {
    position,
    normal,
    index: mesh.index,
    owner: Uint16Array.from(mesh.owner),
    scale: builder.scale,
  };
}
