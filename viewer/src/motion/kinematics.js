// A skeleton's forward kinematics, its T-pose and the rotations of VRM's bones. Right-handed, Y up,
// metres. The arrays belong to the object and are overwritten by the next pose.
import { capsulesOf } from './capsules.js';
import { invert, multiply, rotate } from './quaternion.js';

const IDENTITY = [0, 0, 0, 1];

// Whether the message's lists fit each other and parents come before their children.
export function isSound({ parent, offset_m, humanoid_bone, T_world_joint_xyzw, root_joint }) {
  const count = parent.length;
  return (
    count > 0 &&
    count <= 512 &&
    offset_m.length === 3 * count &&
    T_world_joint_xyzw.length === 4 * count &&
    humanoid_bone.length === count &&
    root_joint < count &&
    parent.every((above, joint) => above >= -1 && above < joint)
  );
}

export class Kinematics {
  // message: posed.v1.Skeleton that isSound().
  constructor(message) {
    const count = message.parent.length;
    this.count = count;
    this.names = message.joint_name;
    this.bones = message.humanoid_bone;
    this.parent = Int32Array.from(message.parent);
    this.offset = Float32Array.from(message.offset_m);
    this.rest = Float32Array.from(message.T_world_joint_xyzw);
    const tips = message.end_site_m;
    this.tip =
      tips.length === 3 * count ? Float32Array.from(tips) : new Float32Array(3 * count).fill(NaN);
    this.root = message.root_joint;
    this.capsules = capsulesOf(message); // of a robot
    this.rotation = new Float32Array(4 * count); // in the world
    this.position = new Float32Array(3 * count); // in the world [m]
    this.boneAbove = this.bonesAbove(Boolean);
    this.fromRest = new Float32Array(4 * count);
    this.local = new Float32Array(4 * count);
  }

  jointOf(bone) {
    return this.bones.indexOf(bone);
  }

  // World rotations and positions of all joints. rotation: parent-relative, 4 per joint; root_m:
  // where the root joint is.
  pose(rotation, root_m) {
    for (let joint = 0; joint < this.count; joint += 1) this.#place(joint, rotation);
    const { position, root } = this;
    const x = root_m[0] - position[3 * root];
    const y = root_m[1] - position[3 * root + 1];
    const z = root_m[2] - position[3 * root + 2];
    for (let i = 0; i < position.length; i += 3) {
      position[i] += x;
      position[i + 1] += y;
      position[i + 2] += z;
    }
  }

  #place(joint, rotation) {
    const above = this.parent[joint];
    if (above < 0) {
      for (let i = 0; i < 4; i += 1) this.rotation[4 * joint + i] = rotation[4 * joint + i];
      this.position.fill(0, 3 * joint, 3 * joint + 3);
      return;
    }
    multiply(this.rotation, 4 * joint, this.rotation, 4 * above, rotation, 4 * joint);
    this.#step(this.position, this.rotation, joint, above);
  }

  // position[joint] = position[above] + the joint's offset, turned by the rotation above.
  #step(position, rotation, joint, above) {
    rotate(position, 3 * joint, rotation, 4 * above, this.offset, 3 * joint);
    for (let i = 0; i < 3; i += 1) position[3 * joint + i] += position[3 * above + i];
  }

  // Where the joint's tip (fingertip, toes, top of the head) is; false when it has none.
  tipOf(joint, out, o) {
    if (Number.isNaN(this.tip[3 * joint])) return false;
    rotate(out, o, this.rotation, 4 * joint, this.tip, 3 * joint);
    for (let i = 0; i < 3; i += 1) out[o + i] += this.position[3 * joint + i];
    return true;
  }

  // Positions in the T-pose, the first joint at the origin. A new array.
  restPositions() {
    const places = new Float32Array(3 * this.count);
    for (let joint = 0; joint < this.count; joint += 1) {
      if (this.parent[joint] >= 0) this.#step(places, this.rest, joint, this.parent[joint]);
    }
    return places;
  }

  // `local`: rotations of the VRM bones relative to the bone above, of the pose that was set last;
  // all are identity in the T-pose. A joint between two bones is part of the lower one. An avatar
  // that lacks some of the bones passes its own list of the bones above.
  humanoidLocals(boneAbove = this.boneAbove) {
    const { fromRest, local } = this;
    for (let joint = 0; joint < this.count; joint += 1) {
      invert(local, 4 * joint, this.rest, 4 * joint);
      multiply(fromRest, 4 * joint, this.rotation, 4 * joint, local, 4 * joint);
    }
    for (let joint = 0; joint < this.count; joint += 1) {
      if (!this.bones[joint]) continue;
      const above = boneAbove[joint];
      if (above < 0) invert(local, 4 * joint, IDENTITY, 0);
      else invert(local, 4 * joint, fromRest, 4 * above);
      multiply(local, 4 * joint, local, 4 * joint, fromRest, 4 * joint);
    }
    return local;
  }

  // For each joint the next one above whose bone counts, -1 without one. counts(bone): a boolean
  bonesAbove(counts) {
    return this.bones.map((_, joint) => {
      let above = this.parent[joint];
      while (above >= 0 && !counts(this.bones[above])) above = this.parent[above];
      return above;
    });
  }
}
