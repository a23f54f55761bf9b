// A slider with a number field. It follows the daemon's value, except while a person moves it or a
// change is on its way.
import { Latest } from '../link/latest.js';
import { el, labelled, write } from './dom.js';

const QUIET_MS = 1200; // after the last move: the daemon's statistics may be older

export class Slider {
  #moved_ms = -Infinity;
  #target = 0; // the daemon's, as it was heard last
  #value = 0; // the last that was a number: an emptied field is none

  // limits: the field's {min, max}; shown: the slider's, within them; send(number): a promise of
  // the reply
  constructor(text, { min, max, shown = [min, max], step = 0.01, send, hint = '' }) {
    this.latest = new Latest(async (value) => {
      const reply = await send(value);
      if (reply?.ok === false) this.#goBack();
    });
    this.range = el('input', { type: 'range', min: shown[0], max: shown[1], step, title: hint });
    this.range.setAttribute('value', '0');
    this.field = el('input', {
      type: 'number',
      min,
      max,
      step: 5 * step,
      aria: { label: `${text}, number` },
    });
    this.range.oninput = () => this.#moved(Number(this.range.value), this.range);
    this.field.onchange = () => this.#moved(this.field.valueAsNumber, this.field);
    this.note = el('span.note');
    this.element = labelled(text, this.range, this.field, this.note);
    this.element.classList.add('slider');
  }

  get value() {
    return this.#value;
  }

  #moved(value, from) {
    if (!Number.isFinite(value)) {
      this.field.value = this.#value.toFixed(2);
      return;
    }
    this.#value = value;
    this.#moved_ms = performance.now();
    if (from !== this.field) this.field.value = value.toFixed(2);
    if (from !== this.range) this.range.value = String(value);
    this.latest.put(value);
  }

  // The daemon has refused: what is shown is what it has.
  #goBack() {
    this.#moved_ms = -Infinity;
    this.#show(this.#target);
  }

  #show(target) {
    const text = target.toFixed(2);
    this.#value = Number(text);
    if (this.field.value !== text) this.field.value = text;
    if (this.range.value !== String(target)) this.range.value = String(target);
  }

  // By the keyboard.
  nudge(step) {
    const value = Math.min(
      Math.max(this.value + step, Number(this.field.min)),
      Number(this.field.max),
    );
    this.field.value = value.toFixed(2);
    this.#moved(value, this.field);
  }

  // The daemon's target, and its present value while it glides there.
  follow(target, value = target) {
    const glides = Math.abs(target - value) >= 0.005;
    this.#target = target;
    write(this.note, glides ? `now ${value.toFixed(2)}` : '');
    if (this.latest.busy || performance.now() - this.#moved_ms < QUIET_MS) return;
    if (document.activeElement === this.field) return;
    this.#show(target);
  }
}
