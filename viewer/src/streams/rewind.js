// The last half minute as it came, and a time in it that is shown in place of the present.

const KEPT_MS = 30000;
const MOST_BYTES = 48e6;

export class Rewind {
  #kept = []; // {at_ms, topic, bytes, from}, oldest first
  #first = 0; // of those that count
  #bytes = 0;
  paused_ms = NaN; // performance.now() when the present was left

  get paused() {
    return !Number.isNaN(this.paused_ms);
  }

  // A message of a pose; its bytes are nobody else's.
  keep(topic, bytes, from, at_ms) {
    this.#kept.push({ at_ms, topic, bytes, from });
    this.#bytes += bytes.length;
    const oldest_ms = at_ms - KEPT_MS;
    while (this.#kept[this.#first].at_ms < oldest_ms || this.#bytes > MOST_BYTES) {
      this.#bytes -= this.#kept[this.#first].bytes.length;
      this.#kept[this.#first] = null;
      this.#first += 1;
    }
    if (this.#first > 1000 && 2 * this.#first > this.#kept.length) {
      this.#kept.splice(0, this.#first);
      this.#first = 0;
    }
  }

  pause(now_ms) {
    this.paused_ms = now_ms;
  }

  resume() {
    this.paused_ms = NaN;
  }

  // How far back there is something to see [ms].
  get reach_ms() {
    if (this.#first === this.#kept.length) return 0;
    return Math.max(0, this.paused_ms - this.#kept[this.#first].at_ms);
  }

  // Calls show(topic, bytes, from) with the message of each topic that was the newest `ago_ms`
  // before the pause.
  at(ago_ms, show) {
    const until_ms = this.paused_ms - ago_ms;
    const done = new Set();
    for (let i = this.#kept.length - 1; i >= this.#first; i -= 1) {
      const { at_ms, topic, bytes, from } = this.#kept[i];
      if (at_ms > until_ms || done.has(topic)) continue;
      if (at_ms < until_ms - 1000) break; // of a stream that was not there
      done.add(topic);
      show(topic, bytes, from);
    }
  }
}
