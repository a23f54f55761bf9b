// The mannequin as its users load it: by three-vrm.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Quaternion, Vector3 } from 'three';
import { loadAvatar, hipsHeight } from '../../src/scene/avatar.js';
import { Avatars, BONES, MANNEQUIN } from '../../src/scene/avatars.js';
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
  assert.ok(Math.abs(hips - (0.945 / 0.915) * root_position_m[1]) < 1e-3);
});

test('the height of the hips counts tips: a foot without toes ends at its own', async () => {
  const message = bodyMessage();
  assert.ok(Math.abs(hipsHeight(new Kinematics(message)) - 0.915) < 1e-6);
  for (const side of ['left', 'right']) {
    const foot = message.humanoid_bone.indexOf(`${side}Foot`);
    message.end_site_m.splice(3 * foot, 3, 0, -0.045, 0.13);
    message.offset_m.splice(3 * foot + 3, 3, 0, 0, 0); // the toes are where the ankle is
    message.humanoid_bone[foot + 1] = '';
    message.end_site_m.splice(3 * foot + 3, 3, NaN, NaN, NaN);
  }
  const kinematics = new Kinematics(message);
  assert.ok(Math.abs(hipsHeight(kinematics) - 0.915) < 1e-6);
  const avatar = await loadAvatar(mannequin().buffer, 'mannequin');
  kinematics.pose(message.T_world_joint_xyzw, [0, 0.915, 0]);
  avatar.fit(kinematics);
  avatar.pose(kinematics);
  avatar.vrm.scene.updateMatrixWorld(true);
  const toes = avatar.vrm.humanoid.getRawBoneNode('leftToes').getWorldPosition(new Vector3());
  assert.ok(Math.abs(toes.y - 0.033) < 0.01, String(toes.y)); // its sole, 32 mm below, at 0
});

const answers = (bytes) => async () => ({ ok: true, arrayBuffer: async () => bytes });

// Avatars for one body that notes what it wears.
function dressing(context) {
  const { fetch } = globalThis;
  globalThis.fetch = answers(mannequin().buffer);
  context.after(() => {
    globalThis.fetch = fetch;
  });
  const worn = [];
  const wear = (avatar) => {
    body.avatar = avatar;
    worn.push(avatar?.name ?? BONES);
  };
  const body = { stream: { name: 'a' }, avatar: null, wear };
  const said = [];
  const world = { performers: new Map([['a', body]]), stage: new EventTarget(), touch() {} };
  world.stage.dataset = {};
  const avatars = new Avatars(
    world,
    (sentence) => said.push(sentence),
    () => {},
  );
  return { avatars, world, worn, said, body };
}

test('an avatar that is no longer chosen, or whose body has left, is not worn', async (context) => {
  const { avatars, world, worn, body } = dressing(context);
  const first = avatars.wear(MANNEQUIN);
  await avatars.wear(BONES);
  await first;
  assert.equal(body.avatar, null);
  const second = avatars.wear(MANNEQUIN);
  world.performers.clear();
  await second;
  assert.ok(!worn.includes(MANNEQUIN));
});

test('a body wears what was chosen for it, the others what all wear', async (context) => {
  const { avatars, body } = dressing(context);
  await avatars.wear(BONES);
  await avatars.wear(MANNEQUIN, 'a');
  assert.equal(body.avatar.name, MANNEQUIN);
  await avatars.wear(null, 'a');
  assert.equal(body.avatar, null);
  assert.equal(avatars.chosen('a'), null);
  await avatars.wear(MANNEQUIN);
  assert.equal(body.avatar.name, MANNEQUIN);
});

test('a dropped file that is no avatar is not listed, whoever is there', async (context) => {
  const { avatars, world, said } = dressing(context);
  world.performers.clear();
  const drop = new Event('drop');
  const file = { name: 'notes.vrm', arrayBuffer: async () => new ArrayBuffer(10) };
  drop.dataTransfer = { files: [file] };
  world.stage.dispatchEvent(drop);
  while (said.length === 0) await new Promise(setImmediate);
  assert.match(said[0], /notes cannot be read as VRM/);
  assert.deepEqual(avatars.names, [MANNEQUIN]);
});

test('a file that is no avatar is refused with a sentence', async () => {
  await assert.rejects(
    loadAvatar(new ArrayBuffer(10), 'notes.txt'),
    /notes.txt cannot be read as VRM/,
  );
});
