// What teaching a style and teaching signs have in common: a fold with a name, "Learn" and
// "Cancel". All of it is known by the daemon; the page asks while something is under way.
import { el, labelled, write } from './dom.js';

const LOOK_MS = 250;
const NAME = /^[a-z0-9_-]{1,32}$/;
// Teaching.Step
export const STEP = { idle: 0, marking: 1, checking: 2, training: 3, starting: 4, inUse: 5 };

export class Lesson {
  static #open = {}; // by title; also when the controls are made again for a new model

  now = { step: STEP.idle };

  // train: what is learnt, beside its name, as the request has it; rows: elements above the name
  constructor(stream, { requests }, title, train = {}) {
    Object.assign(this, { name: stream.name, requests, title });
    this.called = el('input', {
      type: 'text',
      maxLength: 32,
      placeholder: 'a-z, digits, - and _',
      oninput: () => this.show(),
    });
    const button = (text, step) =>
      el('button', { type: 'button', onclick: () => this.ask(step()) }, text);
    this.learn = button('Learn', () => ({ train: { name: this.called.value, ...train } }));
    this.cancel = button('Cancel', () => ({ cancel: {} }));
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
      this.words,
    );
    this.show();
  }

  #toggled() {
    Lesson.#open[this.title] = this.element.open;
    if (this.element.open) this.ask({});
  }

  // The fold says what comes of it: a step that has begun is not yet done.
  async ask(step) {
    clearTimeout(this.timer);
    const reply = await this.requests.ask({ teach: { stream: this.name, ...step } });
    if (reply.ok) {
      const { teaching } = reply;
      this.now = teaching.stream === this.name ? teaching : { step: STEP.idle };
    }
    this.show(reply.ok ? '' : reply.error);
    if (this.busy && this.element.isConnected) this.timer = setTimeout(() => this.ask({}), LOOK_MS);
  }

  get busy() {
    return this.now.step !== STEP.idle && this.now.step !== STEP.inUse;
  }

  // ready: enough was marked to learn from
  showLesson(ready, refusal) {
    this.learn.disabled = this.busy || !ready || !NAME.test(this.called.value);
    this.cancel.hidden = !this.busy;
    write(this.words, refusal || this.#sentence());
  }

  #sentence() {
    const { step, problem, verdict, model, sequence, train_s } = this.now;
    if (step === STEP.training || step === STEP.starting) return 'learning …';
    if (step !== STEP.inUse) return problem ?? '';
    const used = sequence > 0 ? `in use ${train_s.toFixed(1)} s after “Learn”` : 'kept';
    return `✓ ${model} is ${used}; ${verdict}`;
  }
}

// How it went: what is shown below the button that began it.
export function verdictOf({ good = false, sentence = '' } = {}) {
  return sentence && `${good ? '✓' : '✗'} ${sentence}`;
}
