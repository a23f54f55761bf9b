// posed.v1.Frame into an object that is reused: the only message that comes often.
import { Reader } from './reader.js';
import { Words } from './words.js';

export const QUALITIES = ['measured', 'predicted', 'held', 'stale'];
export const SOURCES = ['device', 'file', 'replay', 'labels'];

const MOST_JOINTS = 512;
const MOST_STAGES = 16;
const NS_PER_MS = 1e6;
const LABELS = 3; // in SOURCES

export class Pose {
  sequence = 0;
  arrival_ms = 0; // on the daemon's monotonic clock, as published_ms
  published_ms = 0; // 0: not known
  skeletonId = 0;
  root_m = new Float32Array(3);
  joints = 0;
  rotation = new Float32Array(4 * MOST_JOINTS);
  validJoints = 0; // bytes of `validity`
  validity = new Uint8Array(MOST_JOINTS);
  quality = 0;
  source = 0;
  label = '';
  labelProbability = 0;
  lagFrames = 0;
  lag_ms = 0;
  stages = 0;
  stage_us = new Float32Array(MOST_STAGES);
  timecode = '';

  get performed() {
    return this.source === LABELS;
  }
}

const reader = new Reader();
const words = new Words();

// Fills `list` from a packed field and returns how many values it had; more than fit are dropped.
function floats(list) {
  const count = reader.length() >> 2;
  const { view, at } = reader;
  const kept = Math.min(count, list.length);
  for (let i = 0; i < kept; i += 1) list[i] = view.getFloat32(at + 4 * i, true);
  reader.at = at + 4 * count;
  return kept;
}

function word() {
  const size = reader.length();
  const text = words.at(reader.bytes, reader.at, size);
  reader.at += size;
  return text;
}

function validity(pose) {
  const size = reader.length();
  pose.validJoints = Math.min(size, MOST_JOINTS);
  for (let i = 0; i < pose.validJoints; i += 1) pose.validity[i] = reader.bytes[reader.at + i];
  reader.at += size;
}

// What a message leaves out has proto3's default.
function clear(pose) {
  pose.sequence = 0;
  pose.published_ms = 0;
  pose.joints = 0;
  pose.validJoints = 0;
  pose.quality = 0;
  pose.source = 0;
  pose.label = '';
  pose.labelProbability = 0;
  pose.lagFrames = 0;
  pose.lag_ms = 0;
  pose.stages = 0;
  pose.timecode = '';
}

// By field number << 3 | wire type.
const FIELDS = {
  [(2 << 3) | 0]: (pose) => {
    pose.sequence = reader.uint();
  },
  [(4 << 3) | 0]: (pose) => {
    pose.arrival_ms = reader.int() / NS_PER_MS;
  },
  [(7 << 3) | 5]: (pose) => {
    pose.skeletonId = reader.fixed32();
  },
  [(8 << 3) | 2]: (pose) => {
    floats(pose.root_m);
  },
  [(9 << 3) | 2]: (pose) => {
    pose.joints = floats(pose.rotation) >> 2;
  },
  [(10 << 3) | 2]: validity,
  [(12 << 3) | 0]: (pose) => {
    pose.quality = reader.uint();
  },
  [(13 << 3) | 0]: (pose) => {
    pose.source = reader.uint();
  },
  [(14 << 3) | 2]: (pose) => {
    pose.label = word();
  },
  [(15 << 3) | 5]: (pose) => {
    pose.labelProbability = reader.float();
  },
  [(16 << 3) | 0]: (pose) => {
    pose.lagFrames = reader.uint();
  },
  [(17 << 3) | 5]: (pose) => {
    pose.lag_ms = reader.float();
  },
  [(20 << 3) | 0]: (pose) => {
    pose.published_ms = reader.int() / NS_PER_MS;
  },
  [(21 << 3) | 2]: (pose) => {
    pose.stages = floats(pose.stage_us);
  },
  [(22 << 3) | 2]: (pose) => {
    pose.timecode = reader.string();
  },
};

export function readPose(bytes, from, pose) {
  clear(pose);
  reader.begin(bytes, from);
  while (reader.more()) {
    const tag = reader.tag();
    const read = FIELDS[tag];
    if (read) read(pose);
    else reader.skip(tag & 7);
  }
  return pose;
}
