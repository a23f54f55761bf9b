// The other live parameters of the stages, as the statistics list them: a number field each.
import { el, labelled } from './dom.js';

const SHOWN_ELSEWHERE = new Set(['style.alpha', 'style.weights', 'style.mask']);
const FLAGS = new Set(['gate', 'auto_alpha', 'enabled']);

export class Parameters {
  #fields = new Map();

  constructor(stream, control) {
    this.name = stream.name;
    this.control = control;
    const rows = [];
    for (const stage of stream.stats.stage) {
      for (const { name, text } of stage.parameter) {
        const whole = `${stage.name}.${name}`;
        if (!SHOWN_ELSEWHERE.has(whole)) rows.push(this.#row(whole, FLAGS.has(name), text !== ''));
      }
    }
    this.element = el(
      'details',
      { hidden: rows.length === 0 },
      el('summary', {}, 'More parameters'),
      ...rows,
    );
  }

  #row(whole, isFlag, isText) {
    const field = el('input', {
      type: isFlag ? 'checkbox' : isText ? 'text' : 'number',
      step: 'any',
    });
    field.onchange = () => {
      const value = isFlag
        ? { flag: field.checked }
        : isText
          ? { text: field.value }
          : { number: Number(field.value) };
      const shown = isFlag ? field.checked : field.value;
      this.control(
        { set_parameter: { stream: this.name, name: whole, ...value } },
        `${this.name}: ${whole} ${shown}`,
      );
    };
    this.#fields.set(whole, field);
    return labelled(whole, field);
  }

  update(stream) {
    for (const stage of stream.stats.stage) {
      for (const { name, target, text } of stage.parameter) {
        const field = this.#fields.get(`${stage.name}.${name}`);
        if (!field || document.activeElement === field) continue;
        if (field.type === 'checkbox') field.checked = target !== 0;
        else field.value = field.type === 'text' ? text : String(Number(target.toPrecision(6)));
      }
    }
  }
}
