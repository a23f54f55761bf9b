// The other live parameters of the stages, as the statistics list them: a number field,
// a box or a choice of words each.
import { el, labelled } from './dom.js';

const SHOWN_ELSEWHERE = new Set(['style.alpha', 'style.weights', 'style.mask']);
const FLAGS = new Set(['gate', 'auto_alpha', 'enabled']);
// Parameters with a few words: the statistics give the number of the word in the daemon's list.
const WORDS = { 'feet.root': ['off', 'stride', 'actor'] };

function makeField(whole, name, text) {
  if (WORDS[whole])
    return el('select', {}, ...WORDS[whole].map((word) => el('option', { value: word }, word)));
  const type = FLAGS.has(name) ? 'checkbox' : text === '' ? 'number' : 'text';
  return el('input', { type, step: 'any' });
}

// The field's value as the daemon wants it.
function valueOf(field) {
  if (field.type === 'checkbox') return { flag: field.checked };
  if (field.type === 'number') return { number: field.valueAsNumber };
  return { text: field.value };
}

export class Parameters {
  #fields = new Map();

  constructor(stream, control) {
    this.name = stream.name;
    this.control = control;
    const rows = [];
    for (const stage of stream.stats.stage) {
      for (const { name, text } of stage.parameter) {
        const whole = `${stage.name}.${name}`;
        if (!SHOWN_ELSEWHERE.has(whole)) rows.push(this.#row(whole, makeField(whole, name, text)));
      }
    }
    this.element = el(
      'details',
      { hidden: rows.length === 0 },
      el('summary', {}, 'More parameters'),
      ...rows,
    );
  }

  #row(whole, field) {
    field.onchange = () => {
      const value = valueOf(field);
      if (Number.isNaN(value.number)) {
        field.value = field.defaultValue; // emptied: the last value again
        return;
      }
      this.control(
        { set_parameter: { stream: this.name, name: whole, ...value } },
        `${this.name}: ${whole} ${Object.values(value)[0]}`,
      );
    };
    this.#fields.set(whole, field);
    return labelled(whole, field);
  }

  #showNumber(field, text) {
    field.defaultValue = text;
    field.value = text;
  }

  update(stream) {
    for (const stage of stream.stats.stage) {
      for (const { name, target, text } of stage.parameter) {
        const whole = `${stage.name}.${name}`;
        const field = this.#fields.get(whole);
        if (!field || document.activeElement === field) continue;
        if (field.type === 'checkbox') field.checked = target !== 0;
        else if (WORDS[whole]) field.value = WORDS[whole][target] ?? '';
        else if (field.type === 'text') field.value = text;
        else this.#showNumber(field, String(Number(target.toPrecision(6))));
      }
    }
  }
}
