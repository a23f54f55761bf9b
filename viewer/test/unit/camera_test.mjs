import assert from 'node:assert/strict';
import { test } from 'node:test';
import { HandFinder, landmarksMessage } from '../../src/camera/hands_of.js';

const handsOf = (found) => new HandFinder().handsOf(found);
const points = (x) => Array.from({ length: 21 }, (_, i) => ({ x: x + i / 7, y: 0, z: -1e-9 }));
const found = (...hands) => ({
  multiHandLandmarks: hands.map(() => points(0.5)),
  multiHandWorldLandmarks: hands.map((_, i) => points(i)),
  multiHandedness: hands.map(([label, score]) => ({ label, score })),
});

test('in an unmirrored picture MediaPipe means the other hand', () => {
  const [hand] = handsOf(found(['Left', 0.9]));
  assert.equal(hand.side, 'right');
  assert.equal(hand.points.length, 63);
  assert.deepEqual(handsOf(found()), []);
  assert.deepEqual(handsOf(null), []);
});

test('of two hands of one side the surer one is sent', () => {
  const hands = handsOf(found(['Left', 0.7], ['Left', 0.9], ['Right', 0.6]));
  assert.deepEqual(hands.map(({ side, score }) => [side, score]), [['right', 0.9], ['left', 0.6]]); // prettier-ignore
  assert.equal(hands[0].points[0], 1);
});

test('which side a hand is, many pictures decide', () => {
  const finder = new HandFinder();
  const sides = (...labels) =>
    labels.map((label) => finder.handsOf(found([label, 0.9]))[0]?.side ?? '');
  assert.deepEqual(sides('Left', 'Left', 'Right', 'Left'), Array(4).fill('right'));
  assert.equal(sides(...Array(8).fill('Right')).at(-1), 'left');
  finder.handsOf(found());
  assert.deepEqual(sides('Left'), ['left']); // lost for a moment
  for (let i = 0; i < 20; i += 1) finder.handsOf(found());
  assert.deepEqual(sides('Left'), ['right']); // another hand
});

test('the message has whole nanoseconds, micrometres and the side that the user chose', () => {
  const hands = handsOf(found(['Left', 0.7], ['Right', 1.0000001]));
  const both = landmarksMessage(hands, { time_ms: 1234.5678901 });
  assert.deepEqual(Object.keys(both), ['posed', 'version', 'time_ns', 'hands']);
  assert.ok(JSON.stringify(both).startsWith('{"posed":"landmarks","version":1,'));
  assert.equal(both.time_ns, 1234567890);
  assert.equal(both.hands.length, 2);
  assert.equal(both.hands[1].score, 1);
  assert.equal(both.hands[0].points[3], 0.142857);
  assert.ok(JSON.stringify(both).length < 4096);
  const mine = landmarksMessage(hands, { time_ms: 0, side: 'right' });
  assert.deepEqual(mine.hands.map(({ side, score }) => [side, score]), [['right', 1]]); // prettier-ignore
});
