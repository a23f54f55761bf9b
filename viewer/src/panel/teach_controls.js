// Teaches the chosen body a style: walks as usual and walks in the style, and the daemon learns
// what sets them apart.
import { el, labelled, write } from './dom.js';
import { Lesson, STEP, verdictOf } from './lesson.js';

const WALK_S = 20;

export class TeachControls extends Lesson {
  constructor(stream, context) {
    super(stream, context, 'Teach a style');
    this.walks = [this.#walk(1, 'as usual', false), this.#walk(2, 'in the style', true)];
    this.fold(
      3,
      el('p.note', {}, 'posed learns what sets two walks apart: one as always, one in the style.'),
      ...this.walks.flatMap(({ row, words }) => [row, words]),
    );
  }

  #walk(number, how, style) {
    const ask = (more) => this.ask({ mark: { style, seconds: WALK_S, more } });
    const mark = el('button', { type: 'button', onclick: () => ask(false) });
    const more = el(
      'button',
      {
        type: 'button',
        hidden: true,
        title: `One more walk ${how}, beside those before: the style gets better`,
        onclick: () => ask(true),
      },
      'One more',
    );
    return { row: labelled(`${number}. Walk ${how}`, mark, more), mark, more, words: el('p.note') };
  }

  show(refusal = '') {
    const { step, style, seconds_left, neutral_walk, style_walk } = this.now;
    const walked = [neutral_walk, style_walk];
    this.walks.forEach(({ mark, more, words }, i) => {
      const { takes = 0 } = walked[i] ?? {};
      const marked = step === STEP.marking && style === (i === 1);
      const again = takes > 0 ? 'Again' : 'Walk';
      write(mark, marked ? `${Math.ceil(seconds_left)} s …` : `${again} ${WALK_S} s`);
      mark.disabled = this.busy;
      more.disabled = this.busy;
      more.hidden = takes === 0;
      const kept = takes > 1 ? `; ${takes} walks are kept` : '';
      const verdict = verdictOf(walked[i]);
      write(words, verdict && verdict + kept);
    });
    this.showLesson(
      walked.every((walk) => walk?.takes > 0),
      refusal,
    );
  }
}
