// A BVH as posed writes one for each take: joints, and a row of values per frame. It is untrusted:
// whatever is not sound is an Error whose message is a sentence for people.
import { multiply } from './quaternion.js';

const MOST_JOINTS = 512;
const MOST_VALUES = 60e6;
const AXES = ['X', 'Y', 'Z'];

function reader(text) {
  const words = text.matchAll(/\S+/g);
  return () => words.next().value?.[0] ?? '';
}

function number(word) {
  const value = Number(word);
  if (word === '' || !Number.isFinite(value))
    throw new Error(`“${word.slice(0, 20)}” is no number`);
  return value;
}

const numbers = (next, count) => Array.from({ length: count }, () => number(next()));

// {joints: [{name, parent, offset, tip, channels}], width}; channels: {column, axis, turns}
function readHierarchy(next) {
  const joints = [];
  const open = []; // indices; -1 for an end site
  let width = 0;
  for (let word = next(); word !== 'MOTION'; word = next()) {
    if (word === '') throw new Error('it is no BVH, or it was cut off');
    const above = open.at(-1) ?? -1;
    if (word === 'ROOT' || word === 'JOINT') {
      if (joints.length === MOST_JOINTS) throw new Error('it has too many joints');
      joints.push({ name: next(), parent: above, offset: [0, 0, 0], tip: null, channels: [] });
      if (next() !== '{') throw new Error('a joint has no {');
      open.push(joints.length - 1);
    } else if (word === 'End') {
      next();
      if (next() !== '{' || above < 0) throw new Error('an end site has no place');
      open.push(-1);
    } else if (word === 'OFFSET') {
      const offset = numbers(next, 3);
      if (above >= 0) joints[above].offset = offset;
      else if (open.length > 1) joints[open.at(-2)].tip = offset;
    } else if (word === 'CHANNELS' && above >= 0) {
      for (let left = Math.min(6, number(next())); left > 0; left -= 1) {
        const channel = next();
        const axis = AXES.indexOf(channel[0]);
        if (axis < 0 || width > 6 * MOST_JOINTS) throw new Error('it has an unknown channel');
        joints[above].channels.push({ column: width, axis, turns: channel.endsWith('rotation') });
        width += 1;
      }
    } else if (word === '}') open.pop();
    else if (word !== 'HIERARCHY') throw new Error('it is no BVH');
  }
  if (joints.length === 0) throw new Error('it has no joints');
  return { joints, width };
}

export class Bvh {
  // text: of the file
  constructor(text) {
    const next = reader(text);
    Object.assign(this, readHierarchy(next));
    next(); // Frames:
    this.frames = number(next());
    next(); // Frame
    next(); // Time:
    this.step_s = number(next());
    if (this.frames < 1 || !(this.step_s > 0)) throw new Error('it has no frames');
    if (this.frames * this.width > MOST_VALUES) throw new Error('it is too long to be shown');
    this.values = Float32Array.from({ length: this.frames * this.width }, () => number(next()));
    this.rootIndex = Math.max(
      0,
      this.joints.findIndex(({ channels }) => channels.some(({ turns }) => !turns)),
    );
    this.unit_m = this.#unit();
  }

  get seconds() {
    return this.frames * this.step_s;
  }

  // A BVH does not say its unit. Whoever is larger than ten of it is measured in centimetres.
  #unit() {
    let sum = 0;
    for (const { offset } of this.joints.slice(1)) sum += Math.hypot(...offset);
    return sum > 20 || this.joints.some(({ offset }) => Math.hypot(...offset) > 3) ? 0.01 : 1;
  }

  // Writes a frame's parent-relative rotations (4 per joint) and the root joint's place [m].
  frame(index, rotation, root_m) {
    const row = this.values.subarray(index * this.width, (index + 1) * this.width);
    this.joints.forEach(({ channels }, joint) => {
      turn.fill(0);
      turn[3] = 1;
      for (const { column, axis, turns } of channels) {
        if (!turns) continue;
        const half = (row[column] * Math.PI) / 360;
        step.fill(0);
        step[axis] = Math.sin(half);
        step[3] = Math.cos(half);
        multiply(product, 0, turn, 0, step, 0);
        turn.set(product);
      }
      rotation.set(turn, 4 * joint);
    });
    const root = this.joints[this.rootIndex];
    for (let axis = 0; axis < 3; axis += 1) root_m[axis] = root.offset[axis] * this.unit_m;
    for (const { column, axis, turns } of root.channels)
      if (!turns) root_m[axis] = row[column] * this.unit_m;
  }

  // posed.v1.Skeleton of the file: bones where a joint is called so, as those of posed's own hands
  // are. `like`: of the stream that the take is of; what a BVH has no words for counts if its joints
  // are the same: T-pose, bones, and a robot's shapes.
  skeleton(like) {
    const { joints, unit_m } = this;
    const named = (name) => name.charAt(0).toLowerCase() + name.slice(1);
    const same =
      like?.joint_name.length === joints.length &&
      joints.every(({ name }, i) => name === like.joint_name[i]);
    const flat = (of) => joints.flatMap((joint) => of(joint).map((value) => value * unit_m));
    return {
      id: 1,
      joint_name: joints.map(({ name }) => name),
      parent: joints.map(({ parent }) => parent),
      offset_m: flat(({ offset }) => offset),
      end_site_m: flat(({ tip }) => tip ?? [NaN, NaN, NaN]),
      humanoid_bone: same
        ? like.humanoid_bone
        : joints.map(({ name }) => (BONE.test(named(name)) ? named(name) : '')),
      T_world_joint_xyzw: same ? like.T_world_joint_xyzw : joints.flatMap(() => [0, 0, 0, 1]),
      capsule_joint: same ? like.capsule_joint : [],
      capsule_m: same ? like.capsule_m : [],
      root_joint: this.rootIndex,
    };
  }
}

const BONE =
  /^(hips|spine|chest|upperChest|neck|head|(left|right)(Shoulder|UpperArm|LowerArm|Hand|UpperLeg|LowerLeg|Foot|Toes|(Thumb|Index|Middle|Ring|Little)(Metacarpal|Proximal|Intermediate|Distal)))$/;
const turn = new Float32Array(4);
const step = new Float32Array(4);
const product = new Float32Array(4);

// The same file with the frames from..to alone [s].
export function cutBvh(text, { step_s, frames }, from_s, to_s) {
  const first = Math.min(frames - 1, Math.max(0, Math.round(from_s / step_s)));
  const last = Math.min(frames, Math.max(first + 1, Math.round(to_s / step_s)));
  const lines = text.split('\n');
  const head = lines.findIndex((line) => line.startsWith('Frames:'));
  if (head < 0) throw new Error('it has no line of frames');
  const begin = head + 2;
  const kept = [
    ...lines.slice(0, head),
    `Frames: ${last - first}`,
    lines[head + 1],
    ...lines.slice(begin + first, begin + last),
  ];
  return `${kept.join('\n')}\n`;
}
