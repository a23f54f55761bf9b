// One live plot: title, a sentence that says what to see, axes with units.
import uPlot from 'uplot';
import { el, write } from '../panel/dom.js';

export const WINDOW_S = 20;
const HEIGHT_PX = 118;

const variable = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function axis(label) {
  return {
    stroke: variable('--faint'),
    grid: { stroke: variable('--rule'), width: 1 },
    ticks: { show: false },
    font: '11px system-ui, sans-serif',
    labelFont: '11px system-ui, sans-serif',
    label,
    labelSize: 14,
    labelGap: 0,
    size: 40,
    gap: 4,
  };
}

export class Plot {
  #plot = null;
  #names = [];
  #words = []; // {at_s, text}: written where the time axis has them
  #now_s = 0;

  // unit: of the y axis; range: of the y axis, or a function of [least, most]
  constructor(title, sentence, unit, range) {
    this.unit = unit;
    this.range = range;
    this.now = el('span.now');
    this.area = el('div.plot-area');
    this.element = el(
      'figure.plot',
      { hidden: true }, // until there is something to draw
      el('figcaption', {}, el('h3', {}, title, this.now), el('p.note', {}, sentence)),
      this.area,
    );
    new ResizeObserver(() => this.#resize()).observe(this.area);
  }

  say(text) {
    write(this.now, text);
  }

  // lines: [{name, colour}] with a CSS variable's name as colour. Made again when they differ.
  setLines(lines) {
    const names = lines.map(({ name }) => name).join();
    if (this.#plot && this.#names === names) return;
    this.#names = names;
    this.lines = lines;
    this.#make();
  }

  retheme() {
    if (this.#plot) this.#make();
  }

  #make() {
    this.#plot?.destroy();
    const series = this.lines.map(({ name, colour }) => ({
      label: name,
      stroke: variable(colour),
      width: 1.6,
      points: { show: false },
    }));
    const seconds = {
      ...axis('seconds ago'),
      size: 20,
      incrs: [5, 10, 20],
      values: (_, ticks) => ticks.map((t) => (t === 0 ? 'now' : String(-t))),
    };
    const options = {
      width: this.#width(),
      height: HEIGHT_PX,
      series: [{}, ...series],
      axes: [seconds, axis(this.unit)],
      scales: { x: { time: false, range: [-WINDOW_S, 0] }, y: { range: this.range } },
      legend: { show: this.lines.length > 1, live: false },
      cursor: { show: false },
      pxAlign: 0,
      hooks: { draw: [(plot) => this.#write(plot)] },
    };
    this.#plot = new uPlot(options, [[], ...series.map(() => [])], this.area);
  }

  #width() {
    return Math.max(120, this.area.clientWidth);
  }

  #resize() {
    this.#plot?.setSize({ width: this.#width(), height: HEIGHT_PX });
  }

  // Each word in the middle of its time; one that has no room there is left out.
  #write({ ctx, bbox, valToPos }) {
    if (this.#words.length === 0) return;
    const { devicePixelRatio: ratio } = globalThis;
    ctx.save();
    ctx.font = `600 ${11 * ratio}px system-ui, sans-serif`;
    ctx.fillStyle = variable('--soft');
    ctx.strokeStyle = variable('--edge');
    ctx.lineWidth = 1;
    ctx.textAlign = 'center';
    ctx.textBaseline = 'bottom';
    const places = this.#words.map(({ at_s }) =>
      Math.max(valToPos(at_s - this.#now_s, 'x', true), bbox.left),
    );
    this.#words.forEach(({ text }, i) => {
      const end = places[i + 1] ?? bbox.left + bbox.width;
      if (end <= bbox.left) return; // over before the plot begins
      if (places[i] > bbox.left) ctx.strokeRect(Math.round(places[i]), bbox.top, 0, bbox.height);
      if (ctx.measureText(text).width < end - places[i])
        ctx.fillText(text, 0.5 * (places[i] + end), bbox.top + bbox.height - 2 * ratio);
    });
    ctx.restore();
  }

  // series: a Series whose times are in seconds; the newest is `now_s`. words: what the times mean.
  draw(series, now_s, words = []) {
    if (!this.#plot) return;
    this.#words = words;
    this.#now_s = now_s;
    const [times, ...values] = series.since(now_s - WINDOW_S);
    this.#plot.setData([Array.from(times, (time) => time - now_s), ...values], false);
    this.#plot.setScale('x', { min: -WINDOW_S, max: 0 });
  }
}
