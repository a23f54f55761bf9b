// Stops the scene and goes back over the last half minute. The streams go on meanwhile.
import { el, write } from './dom.js';

export class TimeControls {
  constructor(element, store, world) {
    Object.assign(this, { store, world });
    this.button = el('button', {
      type: 'button',
      onclick: () => this.toggle(),
      title: 'Stop the scene and look back; again: live (p)',
    });
    this.range = el('input', {
      type: 'range',
      min: -30,
      max: 0,
      step: 0.02,
      hidden: true,
      aria: { label: 'Seconds before the pause' },
      oninput: () => this.#look(),
    });
    this.words = el('output', { hidden: true });
    this.element = el('div.time', {}, this.button, this.range, this.words);
    element.append(this.element);
    this.#show();
  }

  toggle() {
    const { rewind } = this.store;
    if (rewind.paused) rewind.resume();
    else {
      rewind.pause(performance.now());
      this.range.min = (-rewind.reach_ms / 1000).toFixed(1);
      this.range.value = '0';
    }
    this.#show();
    this.world.touch();
  }

  #look() {
    this.store.look(-1000 * Number(this.range.value));
    this.#show();
    this.world.touch();
  }

  #show() {
    const { paused } = this.store.rewind;
    write(this.button, paused ? 'Back to live' : 'Pause');
    this.button.classList.toggle('strong', paused);
    this.element.dataset.paused = paused;
    this.range.hidden = !paused;
    this.words.hidden = !paused;
    write(this.words, `Paused: ${Math.abs(Number(this.range.value)).toFixed(1)} s back`);
  }
}
