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
    const ask = (more) =>
      this.askReady(number, { mark: { style, seconds: WALK_S, more } });
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

  show() {
    const { step, style, neutral_walk, style_walk } = this.now;
    const walked = [neutral_walk, style_walk];
    this.walks.forEach(({ mark, more, words }, i) => {
      const { takes = 0, sentence = '' } = walked[i] ?? {};
      const isNow = step === STEP.marking || step === STEP.checking; // and so far nothing is bad
      const marked = isNow && style === (i === 1);
      const again = takes > 0 ? 'Again' : 'Record';
      write(mark, this.count(i + 1, marked) || `${again} ${WALK_S} s`);
      mark.disabled = this.busy;
      more.disabled = this.busy;
      more.hidden = takes === 0;
      const verdict = marked ? sentence : verdictOf(walked[i]);
      const bad = !marked && verdict.startsWith('✗') && takes > 0;
      const kept = takes > 1 || bad ? `; ${takes} good ${takes > 1 ? 'walks are' : 'walk is'} kept` : '';
      write(words, verdict && verdict + kept);
    });
    const lacks = ['as usual', 'in the style'].filter((_, i) => !(walked[i]?.takes > 0));
    this.showLesson(lacks.length > 0 ? `a good walk ${lacks.join(' and one ')}` : '');
  }
}
