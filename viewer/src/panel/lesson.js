// What teaching a style and teaching signs have in common: a fold with a name, "Learn" and
// "Cancel". All of it is known by the daemon; the page asks while something is under way.
import { el, labelled, write } from './dom.js';

const LOOK_MS = { busy: 250, idle: 1000 }; // somebody else may teach the same stream
const NAME = /^[a-z0-9_-]{1,32}$/;
// Teaching.Step
export const STEP = { idle: 0, marking: 1, checking: 2, training: 3, starting: 4, inUse: 5 };
const TABLES = { style: 'style', gesture: 'generate' }; // of the config, by ending

export class Lesson {
  static ready_s = 3; // to take one's place, before a walk or show begins
  // By title, and by stream and title; also when the controls are made again for a new model.
  static #open = {};
  static #called = {};

  now = { step: STEP.idle };
  left_s = 0; // of the countdown
  #other = null; // {stream, kept, step} of a lesson that is not finished, where it is not this one

  // train: what is learnt, beside its name, as the request has it; rows: elements above the name
  constructor(stream, { requests }, title, train = {}) {
    Object.assign(this, { name: stream.name, requests, title });
    this.called = el('input', {
      type: 'text',
      placeholder: 'a-z, digits, - and _',
      value: Lesson.#called[`${title} ${stream.name}`] ?? '',
      oninput: () => {
        Lesson.#called[`${title} ${stream.name}`] = this.called.value;
        this.show();
      },
    });
    this.source = stream.stats?.source_name ?? '';
    const button = (text, step) =>
      el('button', { type: 'button', onclick: () => this.ask(step()) }, text);
    this.learn = button('Learn', () => ({ train: { name: this.called.value, ...train } }));
    this.cancel = el('button', { type: 'button', onclick: () => this.#cancel() }, 'Cancel');
    this.anew = el('button', { type: 'button', hidden: true, onclick: () => this.#beginAnew() });
    this.why = el('p.note');
    this.words = el('p.note', { role: 'status' });
  }

  // step: the number of the last one
  fold(step, ...rows) {
    this.element = el(
      'details',
      { open: Lesson.#open[this.title] ?? false, ontoggle: () => this.#toggled() },
      el('summary', {}, this.title),
      ...rows,
      labelled(`${step}. Name it, and learn`, this.called, this.learn, this.cancel),
      this.why,
      this.words,
      this.anew,
    );
    this.show();
  }

  #toggled() {
    Lesson.#open[this.title] = this.element.open;
    if (this.element.open) this.ask({});
  }

  #cancel() {
    if (this.left_s > 0) this.left_s = 0; // askReady looks at it
    else this.ask({ cancel: {} });
    this.show();
  }

  #beginAnew() {
    this.ask({ forget: {} }, this.#other.stream);
  }

  // Counts down, so that who presses the button has time to take his place, then asks.
  async askReady(key, step) {
    this.key = key;
    for (let left_s = this.constructor.ready_s; left_s > 0; left_s -= 1) {
      this.left_s = left_s;
      this.show();
      await new Promise((done) => {
        setTimeout(done, 1000);
      });
      if (!this.element.isConnected || this.left_s === 0) return undefined;
    }
    this.left_s = 0;
    return this.ask(step);
  }

  // What the button of a walk or show says while this one is counted down or marked; else ''.
  count(key, marked) {
    if (this.left_s > 0 && this.key === key) return `in ${this.left_s} …`;
    return marked ? `${Math.ceil(this.now.seconds_left)} s …` : '';
  }

  // The fold says what comes of it: a step that has begun is not yet done.
  async ask(step, stream = this.name) {
    clearTimeout(this.timer);
    const reply = await this.requests.ask({ teach: { stream, ...step } });
    clearTimeout(this.timer);
    if (reply.ok) this.#hear(reply.teaching);
    const isStep = Object.keys(step).length > 0;
    this.trouble = reply.ok ? '' : reply.error;
    if (isStep) this.refusal = this.trouble;
    this.show();
    if (!this.element.isConnected || !(this.busy || this.element.open)) return;
    this.timer = setTimeout(() => this.ask({}), this.busy ? LOOK_MS.busy : LOOK_MS.idle);
  }

  #hear(teaching) {
    const { stream, step, sign = [], neutral_walk, style_walk } = teaching;
    const own = stream === this.name;
    const kept = (neutral_walk?.takes ?? 0) + (style_walk?.takes ?? 0) + sign.length;
    const unfinished = step !== STEP.inUse && (kept > 0 || step !== STEP.idle);
    this.#other = !own && unfinished ? { stream, kept, step } : null;
    this.now = own ? teaching : { step: STEP.idle };
  }

  get busy() {
    return this.left_s > 0 || (this.now.step !== STEP.idle && this.now.step !== STEP.inUse);
  }

  // missing: what is to be shown before something can be learnt; empty: it is enough
  showLesson(missing) {
    const { value } = this.called;
    const unfit = NAME.test(value) ? '' : 'a name of a-z, 0-9, - and _, at most 32';
    const why = missing || unfit;
    this.learn.disabled = this.busy || why !== '';
    write(this.why, !this.busy && why ? `To learn: ${why}.` : '');
    this.cancel.hidden = !this.busy;
    const { stream: other, kept, step } = this.#other ?? {};
    const shown = kept > 0 ? ` and keeps what it was shown (${kept})` : '';
    this.anew.hidden = !other || step !== STEP.idle;
    write(this.anew, `Forget what ${other} was shown`);
    const taught = other && `${other} is being taught${shown}`;
    write(this.words, this.refusal || this.trouble || taught || this.#sentence());
  }

  #sentence() {
    const { step, problem, verdict, model, sequence, train_s } = this.now;
    if (step === STEP.training || step === STEP.starting) return 'learning …';
    if (step !== STEP.inUse) return problem ?? '';
    const used = sequence > 0 ? `in use ${train_s.toFixed(1)} s after “Learn”` : 'kept';
    const table = TABLES[model.split('.').pop()];
    const whose = this.source ? `source ${this.source}, for all its bodies` : this.name;
    return `✓ ${model} is ${used}; ${verdict}. For the next start, too: model = "…/${model}" in the table ${table} of ${whose}`;
  }
}

// How it went: what is shown below the button that began it.
export function verdictOf({ good = false, sentence = '' } = {}) {
  return sentence && `${good ? '✓' : '✗'} ${sentence}`;
}
