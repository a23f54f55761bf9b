import assert from 'node:assert/strict';
import { test } from 'node:test';
import { BufferGeometry, Color, Group, Vector3 } from 'three';
import { Kinematics } from '../../src/motion/kinematics.js';
import { bodyShape } from '../../src/scene/body_shape.js';
import { COARSE, FINE } from '../../src/scene/capsule.js';
import { JointPaint } from '../../src/scene/joint_paint.js';
import { Performer } from '../../src/scene/performer.js';
import { stoppedJoints } from '../../src/scene/robot_shape.js';
import { Views } from '../../src/scene/views.js';
import { Stream } from '../../src/streams/stream.js';
import { bodySkeleton } from '../support/figures.mjs';

// What OrbitControls wants of the scene's element.
const element = {
  style: {},
  addEventListener() {},
  removeEventListener() {},
  getRootNode: () => element,
};

// How far behind a walker the view looks after 3 s, at so many pictures a second [m].
function lag_m(pictures_per_s) {
  const views = new Views(element, () => {});
  views.resize(1000, 600, { right: 0, bottom: 0, top: 0 });
  const centre = new Vector3(0, 0.9, 0);
  for (let picture = 0; picture <= 3 * pictures_per_s; picture += 1) {
    const now_s = picture / pictures_per_s;
    centre.z = 1.4 * now_s;
    views.update(centre, { row_m: 0.5, way_m: 0 }, false, now_s);
  }
  return centre.distanceTo(views.target);
}

test('the view follows a walker as closely at 8 pictures a second as at 60', () => {
  const [fast, slow] = [lag_m(60), lag_m(8)];
  assert.ok(fast < 0.3, `${fast} m`);
  assert.ok(slow < 0.3, `${slow} m`);
});

// Where a point is in the picture after a while: -1 to 1 across and upwards.
function pictured(view, extent, point) {
  const views = new Views(element, () => {});
  views.resize(1000, 600, { right: 0, bottom: 0, top: 0 });
  views.set(view);
  const centre = new Vector3(0, 0.9, 0);
  for (let picture = 0; picture < 600; picture += 1)
    views.update(centre, extent, false, picture / 60);
  views.camera.updateMatrixWorld();
  return point.clone().project(views.camera);
}

test('every view shows a long row from head to toe, the side view larger than its length asks', () => {
  for (const extent of [
    { row_m: 6, way_m: 0 },
    { row_m: 0, way_m: 6 },
  ]) {
    for (const view of ['follow', 'front', 'side', 'top']) {
      for (const sign of [-1, 1]) {
        for (const y of [0, 1.75]) {
          const point = new Vector3(sign * extent.row_m, y, sign * extent.way_m);
          const { x, y: up } = pictured(view, extent, point);
          assert.ok(Math.abs(x) < 1 && Math.abs(up) < 1, `${view} ${x} ${up}`);
        }
      }
    }
  }
  const [head, feet] = [1.75, 0].map((y) => new Vector3(6, y, 0));
  const high = (point) => pictured('side', { row_m: 6, way_m: 0 }, point).y;
  assert.ok(high(head) - high(feet) > 0.85, `${high(head) - high(feet)} of 2`);
});

test('a coarse figure has the size of the fine one, and less than half of its vertices', () => {
  const kinematics = new Kinematics(bodySkeleton({ stream: 'a', id: 1, stage: [] }));
  const [fine, coarse] = [FINE, COARSE].map((detail) => bodyShape(kinematics, detail));
  assert.ok(coarse.owner.length < 0.5 * fine.owner.length);
  assert.equal(coarse.scale, fine.scale);
  const reach = ({ position }) => Math.max(...position.map(Math.abs));
  assert.ok(Math.abs(reach(coarse) - reach(fine)) < 0.01);
});

test('a raw figure that walks away stays in sight of its twin', () => {
  const theme = { raw: new Color(), rawOpacity: 0.4, performers: [new Color()] };
  const enter = (name) => {
    const stream = new Stream(name);
    stream.setSkeleton(bodySkeleton({ stream: name, id: 1, stage: [] }));
    return new Performer(stream, new Group(), theme, COARSE, 0);
  };
  const [styled, raw] = [enter('walker'), enter('walker-raw')];
  raw.standIn(1.2, 0);
  const stood = new Set();
  for (let z = 0; z < 40; z += 0.1) {
    raw.centre.set(0, 0.9, z).add(raw.figure.group.position);
    raw.keepNear(styled, 3);
    assert.ok(raw.centre.clone().setY(0).length() <= 3, `${z}`);
    stood.add(raw.figure.group.position.z.toFixed(3));
  }
  assert.ok(stood.size > 5 && stood.size < 25, `${stood.size} places`); // and it stays there
  raw.standIn(2.4, 0);
  assert.deepEqual(raw.figure.group.position.toArray(), [2.4, 0, 0]);
});

test('a robot looks like its capsules, and what stopped it is red', () => {
  const message = {
    ...bodySkeleton({ id: 1 }),
    capsule_joint: [1, 4],
    capsule_m: [0, 0, 0, 0, 0.1, 0, 0.02, 0, 0, 0.05, 0, 0, 0.05, 0.01],
  };
  const robot = new Kinematics(message);
  const { position, owner } = bodyShape(robot);
  assert.deepEqual([...new Set(owner)], [1, 4]);
  owner.forEach((joint, i) => {
    const [x, y, z] = position.subarray(3 * i, 3 * i + 3);
    const from_m =
      joint === 1
        ? Math.hypot(x, y - Math.min(Math.max(y, 0), 0.1), z)
        : Math.hypot(x, y, z - 0.05);
    assert.ok(Math.abs(from_m - (joint === 1 ? 0.02 : 0.01)) < 1e-6);
  });
  const stopped = stoppedJoints(robot, { robot_stop_joint: robot.names[4], robot_stop_other: '' });
  const paint = new JointPaint(new BufferGeometry(), owner);
  const own = { getHex: () => 1, toArray: (array, i) => array.fill(0, i, i + 3) };
  paint.paint(own, { quality: 0, validJoints: 0, validity: [] }, stopped);
  owner.forEach((joint, i) => assert.equal(paint.colours.array[3 * i] > 0.5, joint === 4));
  // Lists that do not fit are nobody's.
  for (const wrong of [{ capsule_joint: [1] }, { capsule_joint: [1, 99] }, { capsule_m: [NaN] }])
    assert.equal(new Kinematics({ ...message, ...wrong }).capsules.length, 0);
});
