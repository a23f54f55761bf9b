// The other live parameters of the stages, as the statistics list them: a number field,
// a box or a choice of words each.
import { el, labelled } from './dom.js';

const SHOWN_ELSEWHERE = new Set(['style.alpha', 'style.weights', 'style.mask']);
const FLAGS = new Set(['gate', 'auto_alpha', 'enabled']);
// Parameters with a few words, and what they mean: the statistics give the number of the word in
// the daemon's list.
const WORDS = {
  'feet.root': {
    off: 'as captured: feet may slide',
    stride: 'where the styled feet walk',
    actor: 'on the performer: legs reach down',
  },
};

// What each is called, and what it does.
const LABELS = {
  'gate.jump_deg': [
    'Drop an angle that jumps by more than (°)',
    'Sensors and trackers tell false values now and then. Lower: more is dropped.',
  ],
  'gate.jump_m': [
    'Hold a body that jumps by more than (m)',
    'For such a frame it stays where it was.',
  ],
  'style.alpha_slew_per_s': [
    'Style changes in a second by at most',
    'How softly a new amount sets in: 2 goes from none to all in half a second.',
  ],
  'style.gate': [
    'Fade out in unknown motion',
    'What the model was not taught, such as a jump, passes as it was captured.',
  ],
  'style.gate_fallback': [
    'Posture kept while faded (0 to 1)',
    '0: none of the style is left then; 1: its posture stays, without its movement.',
  ],
  'style.auto_alpha': [
    'Less where the performer has the style already',
    'Who sneaks by himself is not made to sneak twice.',
  ],
  'feet.root': ['Where the body is', 'Styled legs take other steps than those of the performer.'],
  'feet.limit_cm': [
    'Farthest from the performer (cm)',
    'With “on the performer”: so far the body may leave his place, to save the legs a stretch.',
  ],
};
const plainWords = (whole) => LABELS[whole]?.[0] ?? whole;

function makeField(whole, name, text) {
  if (WORDS[whole])
    return el(
      'select',
      {},
      ...Object.entries(WORDS[whole]).map(([value, words]) => el('option', { value }, words)),
    );
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
  #values = new Map(); // the daemon's, as they were heard last

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
    field.onchange = () => this.#changed(whole, field);
    field.title = whole; // as `posed ctl set` and the config name it
    this.#fields.set(whole, field);
    const hint = LABELS[whole]?.[1];
    const row =
      field.type === 'checkbox'
        ? el('div.row', {}, el('label.check', {}, field, plainWords(whole)))
        : labelled(plainWords(whole), field);
    if (hint) row.append(el('p.note', {}, hint));
    return row;
  }

  async #changed(whole, field) {
    const value = valueOf(field);
    if (Number.isNaN(value.number)) {
      field.value = field.defaultValue; // emptied: the last value again
      return;
    }
    const reply = await this.control(
      { set_parameter: { stream: this.name, name: whole, ...value } },
      `${this.name}: ${plainWords(whole)} ${Object.values(value)[0]}`,
    );
    if (!reply.ok) this.#show(whole, field); // refused: what the daemon has
  }

  #show(whole, field) {
    const { target, text } = this.#values.get(whole);
    if (field.type === 'checkbox') field.checked = target !== 0;
    else if (WORDS[whole]) field.value = Object.keys(WORDS[whole])[target] ?? '';
    else if (field.type === 'text') field.value = text;
    else {
      field.defaultValue = String(Number(target.toPrecision(6)));
      field.value = field.defaultValue;
    }
  }

  update(stream) {
    for (const stage of stream.stats.stage) {
      for (const parameter of stage.parameter) {
        const whole = `${stage.name}.${parameter.name}`;
        const field = this.#fields.get(whole);
        if (!field) continue;
        this.#values.set(whole, parameter);
        if (document.activeElement !== field) this.#show(whole, field);
      }
    }
  }
}
