// Teaches the chosen hand signs: each is shown three times, from rest into the sign and back, and
// the daemon learns them all; then they are gestures to perform and to be recognised.
import { el, labelled, write } from './dom.js';
import { Lesson, STEP, verdictOf } from './lesson.js';

const SHOW_S = 5;
const SHOWS = 3; // that a sign needs
const LABEL = /^[!-~]{1,15}$/;

export class SignLesson extends Lesson {
  #listed = '';

  constructor(stream, context) {
    super(stream, context, 'Teach signs', { signs: true });
    this.sign = el('input', {
      type: 'text',
      maxLength: 15,
      placeholder: 'ok',
      autocomplete: 'off',
      oninput: () => this.show(),
    });
    this.begin = el('button', { type: 'button', onclick: () => this.#begin() });
    this.verdict = el('p.note');
    this.signs = el('div.chips', { role: 'group', aria: { label: 'Signs that were shown' } });
    this.fold(
      2,
      el(
        'p.note',
        {},
        `Rest, make the sign, hold it still, rest again; ${SHOWS} times for each sign. ` +
          'Then it is a gesture like the others.',
      ),
      labelled('1. Sign to show', this.sign, this.begin),
      this.verdict,
      this.signs,
    );
  }

  #begin() {
    this.askReady('show', { show: { label: this.sign.value, seconds: SHOW_S } });
  }

  #chip({ label, shows }) {
    const text = `${label} ${shows}/${SHOWS}`;
    const forget = () => this.ask({ forget: { label } });
    return el(
      'button.chip',
      { type: 'button', disabled: this.busy, onclick: forget, title: `Forget ${label}` },
      `${text} ✕`,
    );
  }

  show() {
    const { step, show, sign = [] } = this.now;
    write(this.begin, this.count('show', step === STEP.marking) || `Show ${SHOW_S} s`);
    this.begin.disabled = this.busy || !LABEL.test(this.sign.value);
    write(this.verdict, verdictOf(show));
    const listed = JSON.stringify([sign, this.busy]);
    if (listed !== this.#listed)
      this.signs.replaceChildren(...sign.map((one) => this.#chip(one)));
    this.#listed = listed;
    const few = sign.filter(({ shows }) => shows < SHOWS).map(({ label }) => label);
    const more = few.length > 0 ? `show ${few.join(', ')} ${SHOWS} times` : '';
    this.showLesson(sign.length > 0 ? more : 'show a sign');
  }
}
