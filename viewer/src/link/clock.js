// Maps the daemon's monotonic clock to performance.now() of this page. The bridge answers a clock
// message at once; of the last answers the fastest one counts, because it was delayed least. On one
// machine the error is below half its way there and back.

const KEPT = 16;

export class ClockMapping {
  #samples = []; // {offset_ms, roundTrip_ms}
  offset_ms = NaN; // daemon minus page
  roundTrip_ms = NaN; // of the answer that counts

  // The page asked at `asked_ms`, the answer with the daemon machine's time came at `answered_ms`.
  add(asked_ms, answered_ms, monotonic_ms) {
    const roundTrip_ms = answered_ms - asked_ms;
    if (!(roundTrip_ms >= 0) || !Number.isFinite(monotonic_ms)) return;
    this.#samples.push({ offset_ms: monotonic_ms - (asked_ms + answered_ms) / 2, roundTrip_ms });
    if (this.#samples.length > KEPT) this.#samples.shift();
    let best = this.#samples[0];
    for (const sample of this.#samples) if (sample.roundTrip_ms < best.roundTrip_ms) best = sample;
    this.offset_ms = best.offset_ms;
    this.roundTrip_ms = best.roundTrip_ms;
  }

  // Another connection may lead to another machine.
  clear() {
    this.#samples.length = 0;
    this.offset_ms = NaN;
    this.roundTrip_ms = NaN;
  }

  get known() {
    return Number.isFinite(this.offset_ms);
  }

  // A time of the daemon as performance.now() would have shown it; NaN while unknown.
  toPage_ms(monotonic_ms) {
    return monotonic_ms - this.offset_ms;
  }
}
