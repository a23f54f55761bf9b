// The rotations of a BVH, read without posed: what the exported files are compared with.
import { readFileSync } from 'node:fs';
import { Quaternion } from 'three';

// Joints as { name, channels, column }: `column` is where the joint's channels begin in a frame.
export function readBvh(path) {
  const [hierarchy, motion] = readFileSync(path, 'utf8').split('MOTION');
  const joints = [];
  let column = 0;
  const words = hierarchy.split(/\s+/);
  words.forEach((word, i) => {
    if (word === 'ROOT' || word === 'JOINT') joints.push({ name: words[i + 1] });
    if (word !== 'CHANNELS') return;
    const channels = words.slice(i + 2, i + 2 + Number(words[i + 1]));
    Object.assign(joints.at(-1), { channels, column });
    column += channels.length;
  });
  const frames = motion.trim().split(/\r?\n/).slice(2).map((line) => line.trim().split(/\s+/).map(Number));
  return { joints, frames };
}

function turnAbout(axis, degrees) {
  const half = (degrees * Math.PI) / 360;
  const parts = ['X', 'Y', 'Z'].map((name) => (name === axis ? Math.sin(half) : 0));
  return new Quaternion(...parts, Math.cos(half));
}

// The joint's rotation in its parent's frame.
export function turnOf({ channels, column }, frame) {
  const turn = new Quaternion();
  channels.forEach((channel, i) => {
    if (channel.endsWith('rotation')) turn.multiply(turnAbout(channel[0], frame[column + i]));
  });
  return turn;
}

// [rad]; accurate for small angles, unlike three's angleTo.
export function angleBetween(a, b) {
  const { x, y, z, w } = a.clone().conjugate().multiply(b);
  return 2 * Math.atan2(Math.hypot(x, y, z), Math.abs(w));
}
