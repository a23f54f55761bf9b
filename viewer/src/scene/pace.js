// Keeps the page fluent on a machine without a graphics card: when pictures come too slowly, they
// are drawn coarser, step by step. It never goes back, so that the picture does not waver.

const SLOW_MS = 40; // between two pictures, on average
const LOOK_MS = 1500;
const STEPS = [
  { pixels: 1, shadows: true },
  { pixels: 1, shadows: false },
  { pixels: 0.75, shadows: false },
  { pixels: 0.5, shadows: false },
];
export const [FINEST] = STEPS;
export const COARSEST = STEPS.at(-1);

export class Pace {
  #step = 0;
  #began_ms = NaN;
  #pictures = 0;

  get now() {
    return STEPS[this.#step];
  }

  // After each picture; returns whether the next ones are to be drawn otherwise.
  drawn(now_ms) {
    if (Number.isNaN(this.#began_ms)) this.#began_ms = now_ms;
    this.#pictures += 1;
    const passed_ms = now_ms - this.#began_ms;
    if (passed_ms < LOOK_MS) return false;
    const slow = passed_ms / this.#pictures > SLOW_MS;
    this.rest();
    if (!slow || this.#step + 1 === STEPS.length) return false;
    this.#step += 1;
    return true;
  }

  // Pictures pause: the time until the next one tells nothing.
  rest() {
    this.#began_ms = NaN;
    this.#pictures = 0;
  }
}
