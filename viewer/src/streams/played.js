// Recordings that are played in the scene beside the live streams, over and over until they are
// stopped. Each is a stream of the store that nobody but this sends; the daemon knows nothing of it.
import { isSound } from '../motion/kinematics.js';

export const takeTitle = (number, name) => `take ${number}${name ? ` “${name}”` : ''}`;

// "take 1 “sneak”: walker" of 20261126T065505Z-1-walker.sneak.bvh, as posed names its takes.
export function takeName(file) {
  const [, number, stream, name] = /^.*?-(\d+)-([a-z0-9_-]+)(?:\.(.+))?\.bvh$/.exec(file) ?? [];
  if (!stream) return { text: file, stream: '' };
  return { text: `${takeTitle(number, name)}: ${stream}`, stream };
}

export class Played {
  #playing = new Map(); // by file: {stream, bvh, from_s, to_s, began_ms}

  constructor(store) {
    this.store = store;
  }

  has(file) {
    return this.#playing.has(file);
  }

  // Returns why it cannot be shown; empty when it plays. Its name has a blank, a stream's has none.
  start(file, bvh, from_s, to_s) {
    this.stop(file);
    const { text, stream: of } = takeName(file);
    const name = this.store.streams.has(text) ? `recording ${file}` : text;
    const live = this.store.streams.get(of)?.message;
    const message = { ...bvh.skeleton(live), stream: name };
    const stream = isSound(message) ? this.store.addTake(name, message) : null;
    if (!stream) return 'its figure cannot be drawn';
    this.#playing.set(file, { stream, bvh, from_s, to_s, began_ms: performance.now() });
    return '';
  }

  stop(file) {
    const one = this.#playing.get(file);
    this.#playing.delete(file);
    if (one) this.store.removeTake(one.stream);
  }

  isBody(file) {
    return this.has(file) && !this.#playing.get(file).stream.isHand;
  }

  // Where in the take it is [s]; NaN while it is not played.
  at_s(file, now_ms) {
    const one = this.#playing.get(file);
    if (!one) return NaN;
    const { from_s, to_s, began_ms } = one;
    const length_s = Math.max(to_s - from_s, one.bvh.step_s);
    return from_s + (((now_ms - began_ms) / 1000) % length_s);
  }

  // Before each picture.
  frame(now_ms) {
    if (this.store.rewind.paused) return;
    for (const [file, one] of this.#playing) {
      const { stream, bvh } = one;
      const index = Math.min(bvh.frames - 1, Math.floor(this.at_s(file, now_ms) / bvh.step_s));
      if (index === one.index) continue;
      one.index = index;
      const { pose } = stream;
      bvh.frame(index, pose.rotation, pose.root_m);
      pose.joints = bvh.joints.length;
      pose.skeletonId = stream.message.id;
      pose.arrival_ms = now_ms;
      stream.version += 1;
    }
  }
}
