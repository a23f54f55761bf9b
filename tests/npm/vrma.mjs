// Loads a .vrma as a web page with three-vrm does.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { Quaternion } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { VRMAnimationLoaderPlugin } from '@pixiv/three-vrm-animation';

import { angleBetween, readBvh, turnOf } from './bvh.mjs';
import { posed } from './files.mjs';

async function load(path) {
  const loader = new GLTFLoader();
  loader.register((parser) => new VRMAnimationLoaderPlugin(parser));
  const bytes = readFileSync(path);
  return loader.parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), '');
}

// The joints of the clip have the names of VRM's bones, with a capital. `skeleton` is its message
// posed.v1.Skeleton, whose T frames turn the rotations of its BVH into those of VRM.
export async function checkVrma(program, folder, clip, skeleton) {
  const path = join(folder, 'walk.vrma');
  posed(program, 'convert', clip, '--out', path);
  const warnings = [];
  console.warn = (text) => warnings.push(text);
  const gltf = await load(path);
  assert.deepEqual(warnings, []);
  assert.equal(gltf.userData.vrmAnimations.length, 1);
  const [animation] = gltf.userData.vrmAnimations;
  const { joints, frames } = readBvh(clip);
  const boneOf = ({ name }) => name[0].toLowerCase() + name.slice(1);
  const { rotation, translation } = animation.humanoidTracks;
  assert.deepEqual([...rotation.keys()].sort(), joints.map(boneOf).sort());
  assert.deepEqual([...translation.keys()], ['hips']);
  assert.ok(animation.restHipsPosition.y > 0.5);
  const hips = translation.get('hips').values;
  assert.equal(hips.length, 3 * frames.length);
  const moving = joints[0].channels.filter((channel) => channel.endsWith('position'));
  frames.forEach((frame, i) => {
    moving.forEach((channel, c) => {
      assert.ok(Math.abs(hips[3 * i + 'XYZ'.indexOf(channel[0])] - frame[c] / 100) < 1e-5);
    });
  });
  const tFrame = (joint) =>
    joint < 0 ? new Quaternion() : new Quaternion().fromArray(skeleton.T_world_joint_xyzw, 4 * joint);
  let worst = 0;
  for (const [j, joint] of joints.entries()) {
    const [above, own] = [tFrame(skeleton.parent[j]), tFrame(j).invert()];
    const track = rotation.get(boneOf(joint));
    assert.equal(track.times.length, frames.length);
    frames.forEach((frame, i) => {
      const truth = turnOf(joint, frame).premultiply(above).multiply(own);
      worst = Math.max(worst, angleBetween(truth, new Quaternion().fromArray(track.values, 4 * i)));
    });
  }
  assert.ok(worst < 1e-5, `${worst} rad`);
  console.log(`vrma: ${rotation.size} bones, ${frames.length} frames, at most ${worst.toExponential(1)} rad off`);
}
