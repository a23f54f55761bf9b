import assert from 'node:assert/strict';
import { test } from 'node:test';
import { handsOf as handsOfPicture, landmarksMessage } from '../../src/camera/hands_of.js';

const handsOf = (found) => handsOfPicture(found, 4 / 3);
const points = (x) => Array.from({ length: 21 }, (_, i) => ({ x: x + i / 70, y: 0, z: -1e-9 }));
// Hands side by side, each as [label, score, where its wrist is in the picture].
const found = (...hands) => ({
  multiHandLandmarks: hands.map(([, , x = 0.2], i) => points(x + i / 2)),
  multiHandWorldLandmarks: hands.map(() => points(0)),
  multiHandedness: hands.map(([label, score]) => ({ label, score })),
});

test('in an unmirrored picture MediaPipe means the other hand, and its points are where it is', () => {
  const [hand, other] = handsOf(found(['Left', 0.9], ['Left', 0.8]));
  assert.deepEqual([hand.side, other.side], ['right', 'right']);
  assert.equal(hand.points.length, 63);
  assert.ok(Math.abs(hand.points[0] - -0.3) < 1e-9); // a metre is a width of this picture
  assert.ok(Math.abs(other.points[0] - 0.2) < 1e-9);
  assert.deepEqual(handsOf(found()), []);
  assert.deepEqual(handsOf(null), []);
});

test('of a hand that was found twice the surer one is sent', () => {
  const hands = handsOf(found(['Left', 0.7, 0.21], ['Right', 0.9, -0.3]));
  assert.deepEqual(hands.map(({ side, score }) => [side, score]), [['left', 0.9]]); // prettier-ignore
});

test('the message has whole nanoseconds, micrometres and the side that the user chose', () => {
  const hands = handsOf(found(['Left', 0.7], ['Right', 1.0000001]));
  const both = landmarksMessage(hands, { time_ms: 1234.5678901 });
  assert.deepEqual(Object.keys(both), ['posed', 'version', 'time_ns', 'hands']);
  assert.ok(JSON.stringify(both).startsWith('{"posed":"landmarks","version":1,'));
  assert.equal(both.time_ns, 1234567890);
  assert.equal(both.hands.length, 2);
  assert.equal(both.hands[0].score, 1);
  assert.equal(both.hands[0].sure, undefined);
  assert.ok(JSON.stringify(both).length < 4096);
  const mine = landmarksMessage(hands, { time_ms: 0, side: 'right' });
  assert.deepEqual(mine.hands.map(({ side, sure }) => [side, sure]), [['right', true]]); // prettier-ignore
});
