// The last values of some quantities over time, in flat arrays that are moved, never grown.

export class Series {
  #count = 0;

  // capacity: most points; lines: how many quantities
  constructor(capacity, lines) {
    this.capacity = capacity;
    this.columns = Array.from({ length: lines + 1 }, () => new Float64Array(capacity));
  }

  get length() {
    return this.#count;
  }

  // A point in time [s] with a value of each quantity; NaN where there is none. Times only grow: an
  // older one begins again.
  add(time_s, ...values) {
    if (this.#count > 0 && time_s < this.columns[0][this.#count - 1]) this.#count = 0;
    if (this.#count === this.capacity) this.#drop();
    this.columns[0][this.#count] = time_s;
    for (let i = 0; i < values.length; i += 1) this.columns[i + 1][this.#count] = values[i];
    this.#count += 1;
  }

  // A quarter at once, so that a point does not move all others.
  #drop() {
    const dropped = this.capacity >> 2;
    for (const column of this.columns) column.copyWithin(0, dropped);
    this.#count -= dropped;
  }

  clear() {
    this.#count = 0;
  }

  // The points since `from_s`, as uPlot wants them.
  since(from_s) {
    const [times] = this.columns;
    let first = 0;
    while (first < this.#count && times[first] < from_s) first += 1;
    return this.columns.map((column) => column.subarray(first, this.#count));
  }

  // The value that `share` of the points with this quantity since `from_s` do not exceed; NaN
  // without such points.
  quantile(line, share, from_s = -Infinity) {
    const sorted = this.since(from_s)[line + 1].slice().sort(); // NaN comes last
    let count = sorted.length;
    while (count > 0 && Number.isNaN(sorted[count - 1])) count -= 1;
    if (count === 0) return NaN;
    return sorted[Math.min(count - 1, Math.floor(share * count))];
  }
}
