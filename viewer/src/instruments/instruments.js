// The instruments of the chosen stream. Each plot is drawn a few times a second, in turns, so that
// no animation frame draws more than one.
import { el } from '../panel/dom.js';
import { ms, percent } from '../panel/numbers.js';
import { stageWords } from '../streams/words.js';
import { History } from './history.js';
import { Plot } from './plot.js';
import { Tiles } from './tiles.js';

const TURN_MS = 110;
const COLOURS = ['--plot-1', '--plot-2', '--plot-3', '--plot-4', '--plot-5', '--plot-6'];

// From 0, and high enough that a small change does not look large.
const fromZero = (least) => (_, low, high) => [0, Math.max(least, 1.15 * (high ?? 0))];

export class Instruments {
  #histories = new WeakMap();
  #turn = 0;
  #drawn_ms = 0;
  #frames = [];

  constructor(element) {
    this.element = element;
    element.hidden = true;
    this.tiles = new Tiles();
    this.latency = new Plot(
      'Latency',
      'From a frame’s arrival at posed; lower is better. A jump up: something became slower.',
      'ms',
      fromZero(20),
    );
    this.latency.setLines([
      { name: 'until posed sends it', colour: '--plot-1' },
      { name: 'until it is drawn here', colour: '--plot-2' },
    ]);
    this.stages = new Plot(
      'Time in each step',
      'What each step of posed spends on a frame; one that grows is the one to look at.',
      'µs',
      fromZero(100),
    );
    this.label = new Plot(
      'Gesture',
      'Which gesture is recognised, and how sure posed is; 100 % while posed plays one.',
      '%',
      [0, 105],
    );
    this.label.setLines([{ name: 'probability', colour: '--plot-3' }]);
    this.plots = el(
      'div.plots',
      {},
      ...[this.latency, this.stages, this.label].map((plot) => plot.element),
    );
    this.heading = el('h2', {}, 'Instruments');
    element.append(this.heading, this.tiles.element, this.plots);
  }

  retheme() {
    for (const plot of [this.latency, this.stages, this.label]) plot.retheme();
  }

  history(stream) {
    let history = this.#histories.get(stream);
    if (!history) {
      history = new History();
      this.#histories.set(stream, history);
    }
    return history;
  }

  // A pose was drawn. clock: a ClockMapping, or an unknown one for poses whose times are of another
  // clock; what needs it is then not shown.
  add(stream, drawn_ms, clock) {
    this.history(stream).add(stream.pose, stream.callback_ms, drawn_ms, clock);
  }

  // After each animation frame.
  frame(stream, now_ms) {
    this.#frames.push(now_ms);
    while (this.#frames[0] < now_ms - 1000) this.#frames.shift();
    this.element.hidden = !stream;
    if (!stream || now_ms - this.#drawn_ms < TURN_MS) return;
    this.#drawn_ms = now_ms;
    const turns = [
      () => this.#latency(stream),
      () => this.#stages(stream),
      () => this.#label(stream),
      () => this.tiles.update(stream, this.history(stream), this.#frames.length),
    ];
    turns[this.#turn % turns.length](stream);
    this.#turn += 1;
  }

  #latency(stream) {
    const { latency } = this.history(stream);
    this.latency.element.hidden = latency.length === 0;
    this.latency.say(ms(this.history(stream).picture_ms));
    this.latency.draw(latency, performance.now() / 1000);
  }

  #stages(stream) {
    const { stages } = this.history(stream);
    const names = stream.message?.stage ?? [];
    this.stages.element.hidden = stages.length === 0 || names.length === 0;
    if (this.stages.element.hidden) return;
    this.stages.setLines(
      names.slice(0, COLOURS.length).map((name, i) => ({ name: stageWords(name), colour: COLOURS[i] })),
    );
    this.stages.draw(stages, performance.now() / 1000);
  }

  #label(stream) {
    const history = this.history(stream);
    this.label.element.hidden = !history.labelled;
    if (this.label.element.hidden) return;
    const { label, labelProbability, performed } = stream.pose;
    const words = stream.labelWords;
    this.label.say(
      !label ? 'none' : performed ? `plays ${words}` : `${words}, ${percent(labelProbability)} sure`,
    );
    this.label.draw(history.label, performance.now() / 1000, history.changes);
  }
}
