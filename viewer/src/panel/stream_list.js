// The list of streams: name, state in a word, rate and latency. One is chosen.
import { stateOf } from '../streams/words.js';
import { el, write } from './dom.js';

export class StreamList {
  #rows = new Map();

  constructor(element, store, choose) {
    this.element = element;
    this.store = store;
    this.choose = choose;
  }

  update(chosen) {
    const streams = this.store.main();
    const names = new Set(streams.map(({ name }) => name));
    for (const [name, row] of this.#rows) {
      if (names.has(name)) continue;
      row.button.remove();
      this.#rows.delete(name);
    }
    streams.forEach((stream, i) => this.#update(stream, i, stream === chosen));
  }

  #update(stream, i, isChosen) {
    const { stats } = stream;
    const row = this.#rows.get(stream.name) ?? this.#make(stream.name);
    if (this.element.children[i] !== row.button)
      this.element.insertBefore(row.button, this.element.children[i] ?? null);
    const { word, tone, sentence } = stateOf(stats);
    row.button.setAttribute('aria-checked', String(isChosen));
    row.button.tabIndex = isChosen ? 0 : -1;
    row.state.dataset.tone = tone;
    write(row.state, word);
    const live = stats.state === 'live' && !stats.away;
    write(row.rate, live ? `${stats.rate_hz.toFixed(stats.rate_hz < 99.95 ? 1 : 0)} Hz` : '');
    const late_ms = stats.publish?.p99_us > 0 ? Math.round(stats.publish.p50_us / 1000) : NaN;
    write(row.latency, live && late_ms >= 1 ? `${late_ms} ms delay` : ''); // else at once
    write(row.sentence, sentence);
    row.sentence.hidden = sentence === '';
  }

  #make(name) {
    const [state, rate, latency] = ['span.state', 'span.number', 'span.number'].map((kind) =>
      el(kind),
    );
    latency.title = 'half of the frames take at most this from arrival until posed hands them out';
    const sentence = el('span.sentence');
    const button = el(
      'button.stream',
      { type: 'button', onclick: () => this.choose(name) },
      el('strong', {}, name),
      state,
      rate,
      latency,
      sentence,
    );
    button.setAttribute('role', 'radio');
    button.onkeydown = (event) => this.#move(event, name);
    const row = { button, state, rate, latency, sentence };
    this.#rows.set(name, row);
    return row;
  }

  // Arrow keys choose inside the list, as in any group of radio buttons.
  #move(event, name) {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    event.stopPropagation();
    const names = this.store.main().map((stream) => stream.name);
    const next = names[(names.indexOf(name) + step + names.length) % names.length];
    this.choose(next);
    this.#rows.get(next)?.button.focus();
  }
}
