// The gestures of a hand: a line of labels to perform, and the model's labels to choose from.
import { signWords } from '../streams/words.js';
import { el, labelled } from './dom.js';
import { Slider } from './slider.js';

const TEMPO = { min: 0.5, max: 2 };

export class GestureControls {
  element = el('div.group');
  #chips = new Map();
  #shown = '';

  constructor(stream, control) {
    this.name = stream.name;
    this.control = control;
    this.line = el('input', {
      type: 'text',
      value: stream.name in lines ? lines[stream.name] : '',
      autocomplete: 'off',
      spellcheck: false,
      maxLength: 2000,
    });
    this.line.oninput = () => {
      lines[this.name] = this.line.value;
    };
    this.tempo = new Slider('Tempo', { ...TEMPO, step: 0.05, send: async () => {} });
    this.tempo.follow(1);
    this.loop = el('input', { type: 'checkbox' });
    const clear = el('button.quiet', { type: 'button', onclick: () => this.#write('') }, 'Clear');
    this.chips = el('div.chips', { aria: { label: 'Gestures of the model' } });
    const form = el(
      'form',
      { onsubmit: (event) => this.#play(event) },
      labelled('Gestures to play', this.line),
      this.chips,
      this.tempo.element,
      el(
        'div.buttons',
        {},
        el('button.strong', { type: 'submit' }, 'Play'),
        el('button', { type: 'button', onclick: () => this.#stop() }, 'Stop'),
        clear,
        el('label.check', {}, this.loop, 'Loop'),
      ),
    );
    this.element.append(form);
  }

  #write(text) {
    this.line.value = text;
    lines[this.name] = text;
  }

  #play(event) {
    event?.preventDefault();
    const word = this.line.value
      .trim()
      .split(/\s+/)
      .filter((label) => label !== '');
    if (word.length === 0) {
      this.line.focus();
      return;
    }
    const number = [
      { key: 'tempo', value: this.tempo.value },
      { key: 'loop', value: this.loop.checked ? 1 : 0 },
    ];
    this.control(
      { stage_command: { stream: this.name, name: 'generate.play', word, number } },
      `${this.name}: plays ${word.join(' ')}`,
    );
  }

  #stop() {
    this.control(
      { stage_command: { stream: this.name, name: 'generate.stop-playing', word: [], number: [] } },
      `${this.name}: plays no more`,
    );
  }

  play() {
    this.#play();
  }

  update(stream) {
    const labels = stream.stage('generate')?.word ?? [];
    if (labels.join(' ') === this.#shown) return;
    this.#shown = labels.join(' ');
    this.#chips.clear();
    this.line.placeholder = labels.slice(0, 6).join(' ');
    this.chips.replaceChildren(...labels.map((label) => this.#chip(label, labels)));
  }

  #chip(label, known) {
    const add = () => this.#write(`${this.line.value.trim()} ${label}`.trim());
    const chip = el(
      'button.chip',
      { type: 'button', onclick: add, title: `add ${label} to the line` },
      signWords(label, known),
    );
    this.#chips.set(label, chip);
    return chip;
  }

  // Marks the label that the hand shows now.
  mark(pose) {
    if (this.marked === pose.label) return;
    this.#chips.get(this.marked)?.removeAttribute('data-now');
    this.#chips.get(pose.label)?.setAttribute('data-now', '');
    this.marked = pose.label;
  }
}

// What was typed for each stream, kept while another one is chosen.
const lines = {};
