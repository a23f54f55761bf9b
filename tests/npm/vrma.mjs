// Loads a .vrma as a web page with three-vrm does.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { Quaternion } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { VRMAnimationLoaderPlugin } from '@pixiv/three-vrm-animation';

import { readBvh, turnOf } from './bvh.mjs';
import { posed } from './files.mjs';

async function load(path) {
  const loader = new GLTFLoader();
  loader.register((parser) => new VRMAnimationLoaderPlugin(parser));
  const bytes = readFileSync(path);
  return loader.parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), '');
}

// The demo's walker is the canonical humanoid in its T-pose, so the rotations of its BVH are those of VRM.
export async function checkVrma(program, folder, clip) {
  const path = join(folder, 'walk.vrma');
  posed(program, 'convert', clip, '--out', path);
  const warnings = [];
  console.warn = (text) => warnings.push(text);
  const gltf = await load(path);
  assert.deepEqual(warnings, []);
  assert.equal(gltf.userData.vrmAnimations.length, 1);
  const [animation] = gltf.userData.vrmAnimations;
  const { joints, frames } = readBvh(clip);
  const { rotation, translation } = animation.humanoidTracks;
  assert.deepEqual([...rotation.keys()].sort(), joints.map((joint) => joint.name).sort());
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
  let worst = 0;
  for (const joint of joints) {
    const track = rotation.get(joint.name);
    assert.equal(track.times.length, frames.length);
    frames.forEach((frame, i) => {
      worst = Math.max(worst, turnOf(joint, frame).angleTo(new Quaternion().fromArray(track.values, 4 * i)));
    });
  }
  assert.ok(worst < 1e-3, `${worst} rad`);
  console.log(`vrma: ${rotation.size} bones, ${frames.length} frames, at most ${worst.toExponential(1)} rad off`);
}
