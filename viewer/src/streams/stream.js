// One stream as the page knows it: skeleton, newest pose, statistics, and what follows from them.
import { Kinematics, isSound } from '../motion/kinematics.js';
import { isHand, partWords } from '../motion/body_parts.js';
import { Pose } from '../wire/pose.js';
import { Jitter } from './jitter.js';
import { signWords } from './words.js';

export const RAW_SUFFIX = '-raw';

export class Stream {
  kinematics = null;
  message = null; // posed.v1.Skeleton
  pose = new Pose();
  version = 0; // counts poses
  placed = 0; // the version that `kinematics` shows
  stats = null; // posed.v1.StreamStats
  jitter = new Jitter();
  absent = 0; // statistics in a row that do not have it, without a pose between them
  callback_ms = NaN; // performance.now() when the newest pose came

  // isTake: a recording that is played, which the daemon does not have
  constructor(name, isTake = false) {
    this.name = name;
    this.isTake = isTake;
  }

  get isRaw() {
    return !this.isTake && this.name.endsWith(RAW_SUFFIX);
  }

  // Returns whether it is another skeleton than before.
  setSkeleton(message) {
    if (this.message?.id === message.id || !isSound(message)) return false;
    this.message = message;
    this.kinematics = new Kinematics(message);
    this.isRobot = this.kinematics.capsules.length > 0; // a hand; bodies are none yet
    this.isHand = this.isRobot || isHand(this.kinematics);
    this.partWords = partWords(this.kinematics);
    this.placed = 0;
    return true;
  }

  // The newest pose was read into `pose`.
  posed(now_ms) {
    this.version += 1;
    this.absent = 0;
    this.callback_ms = now_ms;
    this.jitter.add(this.pose.sequence, this.pose.arrival_ms);
  }

  // Places the joints; false when there is nothing new that fits the skeleton.
  place() {
    const { kinematics, pose } = this;
    if (!kinematics || this.placed === this.version) return false;
    if (pose.skeletonId !== this.message.id || pose.joints !== kinematics.count) return false;
    kinematics.pose(pose.rotation, pose.root_m);
    this.placed = this.version;
    return true;
  }

  get drawable() {
    return this.placed > 0;
  }

  // A hand that a tracker no longer sees, which is elsewhere; a silent glove is still on its hand.
  get hasLeft() {
    const { driver = '', state = '' } = this.stats ?? {};
    return driver === 'landmarks' && state !== 'live';
  }

  stage(name) {
    return this.stats?.stage.find((stage) => stage.name === name);
  }

  parameter(stage, name) {
    return this.stage(stage)?.parameter.find((parameter) => parameter.name === name);
  }

  // The label of the newest pose, as people read it.
  get labelWords() {
    return signWords(this.pose.label, this.stage('generate')?.word ?? []);
  }

  // The parts without a value in the newest pose: "left arm, head".
  partsWithoutValue() {
    const { pose } = this;
    if (!this.partWords) return '';
    const missing = new Set();
    for (let joint = 0; joint < pose.validJoints; joint += 1) {
      if (pose.validity[joint] === 0) missing.add(this.partWords[joint]);
    }
    return [...missing].join(', ');
  }
}
