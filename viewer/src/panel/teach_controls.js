// Teaches the chosen stream a style: a walk as usual, one in the style, and the daemon learns what
// sets them apart. All of it is known by the daemon; the page asks while something is under way.
import { el, labelled, write } from './dom.js';

const LOOK_MS = 250;
const WALK_S = 20;
const NAME = /^[a-z0-9_-]{1,32}$/;
const STEP = { idle: 0, marking: 1, checking: 2, training: 3, starting: 4, inUse: 5 }; // Teaching.Step

export class TeachControls {
  static #open = false; // also when the controls are made again for the model that was learnt

  #now = { step: STEP.idle };

  constructor(stream, { control, requests }) {
    Object.assign(this, { name: stream.name, control, requests });
    this.walks = [this.#walk('as usual', false), this.#walk('in the style', true)];
    this.style = el('input', {
      type: 'text',
      maxLength: 32,
      placeholder: 'a-z, digits, - and _',
      oninput: () => this.#show(),
    });
    const button = (text, step, what) =>
      el('button', { type: 'button', onclick: () => this.#ask(step(), what()) }, text);
    this.learn = button(
      'Learn',
      () => ({ train: { name: this.style.value } }),
      () => `${this.name}: learns ${this.style.value}`,
    );
    this.cancel = button(
      'Cancel',
      () => ({ cancel: {} }),
      () => `${this.name}: teaching is cancelled`,
    );
    this.words = el('p.note', { role: 'status' });
    this.element = el(
      'details',
      { open: TeachControls.#open, ontoggle: () => this.#toggled() },
      el('summary', {}, 'Teach a style'),
      ...this.walks.flatMap(({ row, words }) => [row, words]),
      labelled('Name', this.style, this.learn, this.cancel),
      this.words,
    );
    this.#show();
  }

  #walk(how, style) {
    const mark = el('button', { type: 'button' }, `Walk ${WALK_S} s`);
    mark.onclick = () =>
      this.#ask({ mark: { style, seconds: WALK_S } }, `${this.name}: walk ${how}`);
    return { row: labelled(`Walk ${how}`, mark), mark, words: el('p.note') };
  }

  #toggled() {
    TeachControls.#open = this.element.open;
    if (this.element.open) this.#ask({});
  }

  async #ask(step, what) {
    clearTimeout(this.timer);
    const request = { teach: { stream: this.name, ...step } };
    const reply = await (what ? this.control(request, what) : this.requests.ask(request));
    if (reply.ok) {
      const { teaching } = reply;
      this.#now = teaching.stream === this.name ? teaching : { step: STEP.idle };
    }
    this.#show(reply.ok ? '' : reply.error);
    if (this.#busy && this.element.isConnected)
      this.timer = setTimeout(() => this.#ask({}), LOOK_MS);
  }

  get #busy() {
    return this.#now.step !== STEP.idle && this.#now.step !== STEP.inUse;
  }

  #show(refusal = '') {
    const { step, style, seconds_left, neutral_walk, style_walk } = this.#now;
    const walked = [neutral_walk, style_walk];
    this.walks.forEach(({ mark, words }, i) => {
      const marked = step === STEP.marking && style === (i === 1);
      write(mark, marked ? `${Math.ceil(seconds_left)} s …` : `Walk ${WALK_S} s`);
      mark.disabled = this.#busy;
      const { good = false, sentence = '' } = walked[i] ?? {};
      write(words, sentence && `${good ? '✓' : '✗'} ${sentence}`);
    });
    const ready = walked.every((walk) => walk?.good) && NAME.test(this.style.value);
    this.learn.disabled = this.#busy || !ready;
    this.cancel.hidden = !this.#busy;
    write(this.words, refusal || this.#sentence());
  }

  #sentence() {
    const { step, problem, verdict, model, sequence, train_s } = this.#now;
    if (step === STEP.training || step === STEP.starting) return 'learning …';
    if (step !== STEP.inUse) return problem ?? '';
    const from = sequence > 0 ? `from frame ${sequence}, ${train_s.toFixed(1)} s later` : 'kept';
    return `${model}: ${from}; ${verdict}`;
  }
}
