// The mannequin as its users load it: by three-vrm.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Quaternion, Vector3 } from 'three';
import { loadAvatar, hipsHeight } from '../../src/scene/avatar.js';
import { Kinematics } from '../../src/motion/kinematics.js';
import { mannequin } from '../../mannequin/mannequin.mjs';
import { bodySkeleton, walk } from '../support/figures.mjs';

test('the mannequin is a VRM 1.0 avatar with fingers that stands on the ground', async () => {
  const bytes = mannequin();
  const { vrm } = await loadAvatar(bytes.buffer, 'mannequin');
  assert.equal(vrm.meta.metaVersion, '1');
  const bones = Object.keys(vrm.humanoid.humanBones);
  assert.equal(bones.length, 51);
  vrm.scene.updateMatrixWorld(true);
  const low = vrm.humanoid.getRawBoneNode('leftToes').getWorldPosition(new Vector3()).y;
  assert.ok(low > 0 && low < 0.05, String(low));
});

const bodyMessage = () => bodySkeleton({ stream: 'a', id: 1, stage: [] });

// A mannequin in a pose of the walk, and the figure with this skeleton that it follows.
async function posed(message) {
  const avatar = await loadAvatar(mannequin().buffer, 'mannequin');
  const kinematics = new Kinematics(message);
  const { rotation_xyzw, root_position_m } = walk(0.4, 1);
  kinematics.pose(rotation_xyzw, root_position_m);
  avatar.fit(kinematics);
  avatar.pose(kinematics);
  avatar.vrm.scene.updateMatrixWorld(true);
  return { avatar, kinematics, root_position_m };
}

function turnAsTheFigure({ avatar, kinematics }) {
  for (const bone of ['leftLowerArm', 'rightLowerLeg', 'head']) {
    const node = avatar.vrm.humanoid.getRawBoneNode(bone);
    const own = node.getWorldQuaternion(new Quaternion());
    const truth = new Quaternion().fromArray(kinematics.rotation, 4 * kinematics.jointOf(bone));
    assert.ok(own.angleTo(truth) < 1e-3, bone);
  }
}

test('the turn of a bone that the avatar lacks reaches the bones below it', async () => {
  const message = bodyMessage();
  message.humanoid_bone = message.humanoid_bone.map((bone) =>
    bone === 'chest' ? 'upperChest' : bone,
  );
  turnAsTheFigure(await posed(message));
});

test("an avatar's bones turn as the figure's, and its hips are as high for its legs", async () => {
  const { avatar, kinematics, root_position_m } = await posed(bodyMessage());
  turnAsTheFigure({ avatar, kinematics });
  const hips = avatar.vrm.humanoid.getRawBoneNode('hips').getWorldPosition(new Vector3()).y;
  assert.ok(Math.abs(hips - (0.945 / hipsHeight(kinematics)) * root_position_m[1]) < 1e-3);
});

test('a file that is no avatar is refused with a sentence', async () => {
  await assert.rejects(
    loadAvatar(new ArrayBuffer(10), 'notes.txt'),
    /notes.txt cannot be read as VRM/,
  );
});
