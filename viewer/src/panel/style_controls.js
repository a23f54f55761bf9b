// The style of the chosen stream: its amount, whole and by part of the body, and the mixture of
// styles where the model has several.
import { MASK_WORDS, PARTS, maskText, parseMask } from '../motion/body_parts.js';
import { el, write } from './dom.js';
import { Slider } from './slider.js';
import { percent, signed } from './numbers.js';

const LEAST_TOLD = 0.1; // of what the input has of the style; less is within the error
const LARGEST_ALPHA = 2;
const SHOWN_ALPHA = [-0.5, 1.5];

const setText = (stream, name, text) => ({ set_parameter: { stream, name, text } });

// "feminine=0.6,elderly=0.4" as numbers by name.
export function parseWeights(text, names) {
  const given = new Map(
    text.split(',').map((piece) => piece.split('=').map((word) => word.trim())),
  );
  if (text === '') return names.map((_, i) => (i === 0 ? 1 : 0));
  return names.map((name) => Number(given.get(name) ?? 0) || 0);
}

export class StyleControls {
  element = el('div.group');

  constructor(stream, control) {
    this.name = stream.name;
    this.control = control;
    const has = (parameter) => stream.parameter('style', parameter) !== undefined;
    const styles = stream.stage('style').word;
    if (has('alpha')) this.#addAlpha();
    if (has('weights') && styles.length > 1) this.#addWeights(styles);
    if (has('mask')) this.#addMask();
  }

  #addAlpha() {
    this.alpha = new Slider('Amount of style, α', {
      min: -LARGEST_ALPHA,
      max: LARGEST_ALPHA,
      shown: SHOWN_ALPHA,
      hint: '0: as captured, 1: as learnt, −1: the opposite',
      send: (number) =>
        this.control(
          { set_parameter: { stream: this.name, name: 'style.alpha', number } },
          `${this.name}: amount ${signed(number, 2)}`,
        ),
    });
    const scale = el(
      'p.scale',
      { aria: { hidden: 'true' } },
      ...['0 as captured', '1 as learnt'].map((word) => el('span', {}, word)),
    );
    this.facts = el('p.note');
    this.element.append(this.alpha.element, scale, this.facts);
  }

  #addWeights(styles) {
    this.styles = styles;
    this.weights = styles.map(
      (style) =>
        new Slider(style, {
          min: 0,
          max: 1,
          step: 0.01,
          send: () => this.#sendWeights(),
        }),
    );
    const box = el('details', { open: true }, el('summary', {}, 'Mixture of styles'));
    box.append(...this.weights.map(({ element }) => element));
    this.element.append(box);
  }

  #sendWeights() {
    const text = this.styles
      .map((style, i) => `${style}=${this.weights[i].value.toFixed(2)}`)
      .join(',');
    return this.control(setText(this.name, 'style.weights', text), `${this.name}: ${text}`);
  }

  #addMask() {
    this.mask = PARTS.map(
      (part) =>
        new Slider(part, {
          min: 0,
          max: 1,
          step: 0.01,
          send: () => this.#sendMask(),
        }),
    );
    const box = el('details', {}, el('summary', {}, 'Share of the style by body part'));
    box.append(...this.mask.map(({ element }) => element));
    this.element.append(box);
  }

  #sendMask() {
    // The daemon takes no empty text, so the whole body is said with one part.
    const text = maskText(this.mask.map(({ value }) => value)) || `${MASK_WORDS[0]}=1`;
    return this.control(setText(this.name, 'style.mask', text), `${this.name}: ${text}`);
  }

  // After each statistics message.
  update(stream) {
    const parameter = (name) => stream.parameter('style', name);
    if (this.alpha) {
      const { target, value } = parameter('alpha') ?? { target: 0, value: 0 };
      this.alpha.follow(target, value);
      if (stream.stage('style').model) this.#writeFacts(stream.stats);
      else write(this.facts, 'No style is in use: choose a model below, or teach one.');
    }
    if (this.weights) {
      const shares = parseWeights(parameter('weights')?.text ?? '', this.styles);
      shares.forEach((share, i) => this.weights[i].follow(share));
    }
    if (this.mask) {
      parseMask(parameter('mask')?.text ?? '').forEach((factor, i) => this.mask[i].follow(factor));
    }
  }

  #writeFacts({ style_gate, style_estimate }) {
    const facts = [];
    if (style_gate !== undefined) {
      facts.push(
        style_gate > 0.95
          ? 'the model knows this motion'
          : `motion ${Math.round(100 * style_gate)} % familiar to the model: so much of the style is seen`,
      );
    }
    if (style_estimate >= LEAST_TOLD) {
      facts.push(`as captured it already has ${percent(style_estimate)} of the style`);
    }
    write(this.facts, facts.join('; '));
  }
}
