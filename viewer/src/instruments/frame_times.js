// How long the page's script works for a picture: the last thousand times.

const KEPT = 1000;

export class FrameTimes {
  #times_ms = new Float64Array(KEPT);
  count = 0; // of all pictures

  add(time_ms) {
    this.#times_ms[this.count % KEPT] = time_ms;
    this.count += 1;
  }

  clear() {
    this.count = 0;
  }

  // The time that `share` of the pictures do not exceed; NaN before the first.
  quantile(share) {
    const kept = Math.min(this.count, KEPT);
    if (kept === 0) return NaN;
    return this.#times_ms.slice(0, kept).sort()[Math.min(kept - 1, Math.floor(share * kept))];
  }
}
