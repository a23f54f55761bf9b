import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Quaternion, Vector3 } from 'three';
import { Bvh, cutBvh } from '../../src/motion/bvh.js';
import { Kinematics, isSound } from '../../src/motion/kinematics.js';
import { isHand, maskText, parseMask, partWords } from '../../src/motion/body_parts.js';
import { Foot, feetOf } from '../../src/motion/feet.js';
import { facing } from '../../src/scene/facing.js';
import { bodySkeleton, handSkeleton, walk, walkBvh } from '../support/figures.mjs';
import { random } from '../support/random.mjs';

const H = Math.SQRT1_2;
// Three joints in a row, 1 m apart along Y; the T frame of the second is a quarter turn about z.
const chain = {
  joint_name: ['a', 'between', 'b'],
  humanoid_bone: ['hips', '', 'spine'],
  parent: [-1, 0, 1],
  root_joint: 1,
  offset_m: [5, 5, 5, 0, 1, 0, 0, 1, 0],
  T_world_joint_xyzw: [0, 0, 0, 1, 0, 0, H, H, 0, 0, H, H],
  end_site_m: [NaN, NaN, NaN, NaN, NaN, NaN, 0, 0.5, 0],
};
const close = (actual, expected, tolerance = 1e-6) => {
  assert.equal(actual.length, expected.length);
  expected.forEach((value, i) =>
    assert.ok(Math.abs(actual[i] - value) < tolerance, `${[...actual]} not ${expected}`),
  );
};

test('joints are where the rotations put them, and the root joint where the frame says', () => {
  const kinematics = new Kinematics(chain);
  kinematics.pose([0, 0, H, H, 0, 0, 0, 1, 0, 0, H, H], [10, 20, 30]); // quarter turns about z
  close(kinematics.position, [11, 20, 30, 10, 20, 30, 9, 20, 30]);
  close(kinematics.rotation.subarray(8), [0, 0, 1, 0]);
  const tip = [0, 0, 0];
  assert.equal(kinematics.tipOf(0, tip, 0), false);
  assert.equal(kinematics.tipOf(2, tip, 0), true);
  close(tip, [9, 19.5, 30]);
});

test('VRM rotations are those of three.js by the formula T_parent L T_joint^-1', () => {
  const next = random(4);
  const count = 9;
  const turns = (list) => list.flatMap((q) => q.toArray());
  const [rests, locals] = [0, 1].map(() =>
    Array.from({ length: count }, () =>
      new Quaternion(next() - 0.5, next() - 0.5, next() - 0.5, next() - 0.5).normalize(),
    ),
  );
  const parent = Array.from({ length: count }, (_, i) => (i === 0 ? -1 : Math.floor(next() * i)));
  const kinematics = new Kinematics({
    joint_name: parent.map(String),
    humanoid_bone: parent.map((_, i) => `bone${i}`),
    parent,
    root_joint: 0,
    offset_m: parent.flatMap(() => [0, 1, 0]),
    T_world_joint_xyzw: turns(rests),
    end_site_m: [],
  });
  kinematics.pose(turns(locals), [0, 0, 0]);
  const result = kinematics.humanoidLocals();
  parent.forEach((above, joint) => {
    const truth = locals[joint].clone().multiply(rests[joint].clone().invert());
    if (above >= 0) truth.premultiply(rests[above]);
    const own = new Quaternion().fromArray(result, 4 * joint);
    assert.ok(Math.abs(truth.dot(own)) > 1 - 1e-5);
  });
});

test('VRM rotations are identity in the T-pose; a joint between two bones goes to the lower', () => {
  const kinematics = new Kinematics(chain);
  kinematics.pose([0, 0, 0, 1, 0, 0, H, H, 0, 0, 0, 1], [0, 0, 0]); // local rotations of the T-pose
  const locals = kinematics.humanoidLocals();
  close(locals.subarray(0, 4), [0, 0, 0, 1]);
  close(locals.subarray(8, 12).map(Math.abs), [0, 0, 0, 1]);
  kinematics.pose([0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 1], [0, 0, 0]); // the joint between, further
  close(kinematics.humanoidLocals().subarray(8, 12).map(Math.abs), [0, 0, H, H]);
});

test('skeletons whose lists do not fit are refused', () => {
  assert.ok(isSound(chain));
  assert.ok(!isSound({ ...chain, parent: [-1, 2, 0] }));
  assert.ok(!isSound({ ...chain, parent: [-1, 0] }));
  assert.ok(!isSound({ ...chain, root_joint: 3 }));
  assert.ok(!isSound({ ...chain, offset_m: [0] }));
});

test('masks: text to factors and back', () => {
  assert.deepEqual(parseMask('arms=0.5,head=0'), [1, 0, 0.5, 0.5, 1, 1]);
  assert.deepEqual(parseMask('left-leg=0.25'), [1, 1, 1, 1, 0.25, 1]);
  assert.deepEqual(parseMask(''), [1, 1, 1, 1, 1, 1]);
  assert.equal(maskText([1, 0, 0.5, 0.5, 0.25, 1]), 'head=0,arms=0.5,left-leg=0.25');
  assert.equal(maskText([1, 1, 1, 1, 1, 1]), '');
});

test('bodies and hands are told apart, and their parts have words', () => {
  const body = new Kinematics(bodySkeleton({ stream: 'a', id: 1, stage: [] }));
  const hand = new Kinematics(handSkeleton({ stream: 'b', id: 2, stage: [] }));
  assert.deepEqual([isHand(body), isHand(hand)], [false, true]);
  assert.equal(partWords(body)[body.jointOf('leftLowerArm')], 'left arm');
  assert.equal(partWords(body)[body.jointOf('neck')], 'head');
  assert.equal(partWords(hand)[hand.jointOf('rightIndexDistal')], 'index');
});

test("a walker's feet stand in turns, and it faces +Z", () => {
  const kinematics = new Kinematics(bodySkeleton({ stream: 'a', id: 1, stage: [] }));
  const [left, right] = feetOf(kinematics);
  const stood = [0, 0];
  for (let i = 0; i < 240; i += 1) {
    const { root_position_m, rotation_xyzw } = walk(i / 60, 0);
    kinematics.pose(rotation_xyzw, root_position_m);
    [left, right].forEach((foot, side) => {
      foot.update(kinematics, 1000 + (1000 * i) / 60);
      stood[side] += foot.stands ? 1 : 0;
    });
  }
  for (const frames of stood) assert.ok(frames > 60 && frames < 200, String(stood));
  assert.ok(facing(kinematics) === 0);
  const still = new Foot(left.joint, -1);
  for (let i = 0; i < 10; i += 1) still.update(kinematics, 100 * i);
  assert.ok(still.stands && still.speed_m_per_s === 0);
});

test('feet go on after times went back: a recording began again', () => {
  const kinematics = new Kinematics(bodySkeleton({ stream: 'a', id: 1, stage: [] }));
  const [left] = feetOf(kinematics);
  const step = (i, began_ms) => {
    const { root_position_m, rotation_xyzw } = walk(i / 60, 0);
    kinematics.pose(rotation_xyzw, root_position_m);
    left.update(kinematics, began_ms + (1000 * i) / 60);
  };
  for (let i = 0; i < 60; i += 1) step(i, 9e6);
  step(60, 1000);
  assert.ok(left.jumped);
  let stood = 0;
  for (let i = 61; i < 240; i += 1) {
    step(i, 1000);
    assert.equal(left.jumped, false);
    stood += left.stands ? 1 : 0;
  }
  assert.ok(stood > 60 && stood < 140, String(stood));
});

test('three.js and the page turn vectors in the same way', () => {
  const kinematics = new Kinematics({ ...chain, root_joint: 0 });
  const q = new Quaternion(0.1, -0.4, 0.2, 0.6).normalize();
  kinematics.pose([...q.toArray(), 0, 0, 0, 1, 0, 0, 0, 1], [0, 0, 0]);
  close(kinematics.position.subarray(3, 6), new Vector3(0, 1, 0).applyQuaternion(q).toArray());
});

test('a BVH poses a figure as the stream that it was recorded from', () => {
  const text = walkBvh(30, 30);
  const bvh = new Bvh(text);
  assert.deepEqual([bvh.frames, bvh.unit_m, bvh.seconds.toFixed(3)], [30, 0.01, '1.000']);
  const live = bodySkeleton({ stage: [] });
  const message = bvh.skeleton(live);
  assert.ok(isSound(message));
  const [recorded, streamed] = [new Kinematics(message), new Kinematics(live)];
  const [rotation, root_m] = [new Float32Array(4 * bvh.joints.length), new Float32Array(3)];
  for (const index of [0, 7, 29]) {
    bvh.frame(index, rotation, root_m);
    recorded.pose(rotation, root_m);
    const { rotation_xyzw, root_position_m } = walk(index / 30, 0);
    streamed.pose(Float32Array.from(rotation_xyzw), root_position_m);
    for (const bone of ['head', 'leftHand', 'rightToes'])
      for (let i = 0; i < 3; i += 1) {
        const [a, b] = [recorded, streamed].map((of) => of.position[3 * of.jointOf(bone) + i]);
        assert.ok(Math.abs(a - b) < 1e-4, `${bone} ${index}: ${a} ${b}`);
      }
  }
  const capsule_joint = [1];
  const capsule_m = [0, 0, 0, 0, 0.1, 0, 0.02];
  const robot = bvh.skeleton({ ...live, capsule_joint, capsule_m });
  assert.deepEqual(new Kinematics(robot).capsules.length, 1);
  const part = new Bvh(cutBvh(text, bvh, 0.5, 0.8));
  assert.equal(part.frames, 9);
  assert.deepEqual(part.values.slice(0, 6), bvh.values.slice(15 * bvh.width, 15 * bvh.width + 6));
});

test('what is no sound BVH is refused in words', () => {
  const text = walkBvh(3, 30);
  for (const [broken, why] of [
    ['', 'it is no BVH'],
    ['PNG', 'it is no BVH'],
    [text.slice(0, 300), 'it is no BVH|no number|unknown channel|has no'],
    [text.replace('Frames: 3', 'Frames: 4'), 'no number'],
    [text.replace('Frames: 3', 'Frames: 1e12'), 'too long'],
    [text.replace('Frame Time: 0', 'Frame Time: -'), 'no frames|no number'],
    [text.replace('OFFSET 0', 'OFFSET NaN'), 'no number'],
    [`HIERARCHY ${'ROOT a { '.repeat(600)}`, 'too many joints'],
  ])
    assert.throws(() => new Bvh(broken), new RegExp(why));
});
