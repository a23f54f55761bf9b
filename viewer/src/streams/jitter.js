// How unevenly frames arrive: the smoothed difference between the time from one frame to the next
// and the usual one, as RFC 3550 has it. The page sees only some of the frames, so a step of
// several counts as that many usual ones.

const SMOOTHING = 1 / 16;

export class Jitter {
  ms = NaN;
  period_ms = NaN; // the usual time between two frames
  #sequence = 0;
  #arrival_ms = NaN;

  add(sequence, arrival_ms) {
    const steps = sequence - this.#sequence;
    const passed_ms = arrival_ms - this.#arrival_ms;
    this.#sequence = sequence;
    this.#arrival_ms = arrival_ms;
    if (!(steps > 0) || !(passed_ms > 0)) return; // the first, a repeated one, a new run
    const period_ms = passed_ms / steps;
    if (this.period_ms > 0 && period_ms > 10 * this.period_ms) {
      this.period_ms = NaN; // a pause: the next step says what is usual
      return;
    }
    if (!(this.period_ms > 0)) {
      this.period_ms = period_ms;
      this.ms = 0;
      return;
    }
    const off_ms = Math.abs(passed_ms - steps * this.period_ms);
    this.ms += SMOOTHING * (off_ms - this.ms);
    this.period_ms += SMOOTHING * (period_ms - this.period_ms);
  }
}
