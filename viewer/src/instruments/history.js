// What the plots show of each stream, collected at every new pose, also of streams not chosen: who
// chooses one sees its last seconds at once.
import { Series } from './series.js';

const POINTS = 1600; // 20 s at 60 Hz, and the quarter that is dropped at once
const LATELY_S = 3;
const MOST_STAGES = 6;
const MOST_CHANGES = 100; // of the label, that are kept

export class History {
  latency = new Series(POINTS, 2); // ms from arrival: handed out by posed, drawn here
  stages = new Series(POINTS, MOST_STAGES); // µs in each
  label = new Series(POINTS, 1); // probability, %
  callback = new Series(POINTS, 1); // ms from arrival until the page's callback
  changes = []; // {at_s, text}: when another label began, oldest first
  #since_s = -Infinity;

  // pose: the newest; drawn_ms: performance.now() after drawing; clock: a ClockMapping
  add(pose, callback_ms, drawn_ms, clock) {
    const now_s = drawn_ms / 1000;
    if (pose.quality === 3) return; // the same pose again, with its old times
    const arrival_ms = clock.toPage_ms(pose.arrival_ms);
    const inside_ms = pose.published_ms > 0 ? pose.published_ms - pose.arrival_ms : NaN;
    this.latency.add(now_s, inside_ms, drawn_ms - arrival_ms);
    this.callback.add(now_s, callback_ms - arrival_ms);
    const us = pose.stage_us;
    if (pose.stages > 0) this.stages.add(now_s, us[0], us[1], us[2], us[3], us[4], us[5]);
    if (pose.label || now_s - this.#since_s < 20)
      this.label.add(now_s, pose.label ? 100 * pose.labelProbability : NaN);
    if (pose.label) this.#since_s = now_s;
    this.#change(now_s, pose.label);
  }

  // How old the picture is lately: half of the poses of the last seconds were at most so old when
  // they were drawn [ms]; NaN while it is unknown.
  get picture_ms() {
    return this.latency.quantile(1, 0.5, performance.now() / 1000 - LATELY_S);
  }

  get callback_ms() {
    return this.callback.quantile(0, 0.5, performance.now() / 1000 - LATELY_S);
  }

  #change(at_s, text) {
    if (text === (this.changes.at(-1)?.text ?? '')) return;
    this.changes.push({ at_s, text });
    if (this.changes.length > MOST_CHANGES) this.changes.shift();
  }

  get labelled() {
    return performance.now() / 1000 - this.#since_s < 20;
  }
}
