// node --expose-gc bench_reader.mjs: what reading a frame of a body costs, with the page's reader and with protobufjs.
import { Pose, readPose } from '../src/wire/pose.js';
import { bodySkeleton, walk } from './support/figures.mjs';
import { encode, type } from './support/messages.mjs';

const ROUNDS = 200000;
const FEW = 500; // so few that no garbage is collected meanwhile
const joints = bodySkeleton({ stream: 'walker', id: 1, stage: [] }).parent.length;
const bytes = encode('Frame', {
  stream: 'walker',
  sequence: 123456,
  arrival_ns: '71234567890123',
  published_ns: '71234567990123',
  skeleton_id: 7,
  ...walk(1, 1),
  validity: new Uint8Array(joints).fill(1),
  angle_rad: new Array(3 * joints).fill(0.5),
  stage_us: [90, 30],
});
const pose = new Pose();
const Frame = type('Frame');

function measure(name, read) {
  for (let i = 0; i < ROUNDS / 10; i += 1) read();
  const began_ms = performance.now();
  for (let i = 0; i < ROUNDS; i += 1) read();
  const each_us = (1000 * (performance.now() - began_ms)) / ROUNDS;
  globalThis.gc?.();
  const before = process.memoryUsage().heapUsed;
  for (let i = 0; i < FEW; i += 1) read();
  const garbage = Math.round((process.memoryUsage().heapUsed - before) / FEW);
  console.log(
    `${name}: ${each_us.toFixed(2)} µs and ${garbage} bytes of garbage for a frame of ${joints} joints`,
  );
}

measure("the page's reader", () => readPose(bytes, 0, pose));
measure('protobufjs', () => Frame.decode(bytes));
