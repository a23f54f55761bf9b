// One recording of the daemon's folder: its size and time, to download; a take also to play beside
// the live streams, as a whole or a part of it, and that part to download.
import { fetchRecording, keepFile } from '../link/download.js';
import { Bvh, cutBvh } from '../motion/bvh.js';
import { takeName } from '../streams/played.js';
import { el, labelled, write } from './dom.js';
import { megabytes } from './numbers.js';

export class Take {
  #blob = null; // once it was fetched to be played

  // context: {requests, acks, played}
  constructor(file, { requests, acks, played }) {
    Object.assign(this, { file, requests, acks, played });
    const { name, bytes, changed_unix_s: changed, in_use: inUse, problem } = file;
    if (file.being_made || problem) {
      // It is no file (yet).
      const words = problem ? `not made: ${problem}` : 'being made …';
      const tone = problem ? { tone: 'bad' } : {};
      const note = el('p.note', { role: 'status', data: tone }, words);
      this.element = el('li', {}, el('strong', {}, takeName(name).text), note);
      return;
    }
    const when = new Date(1000 * changed).toLocaleString();
    const size = bytes < 1e6 ? `${Math.ceil(bytes / 1000)} kB` : megabytes(bytes);
    const button = (text, onclick) =>
      el(
        'button',
        { type: 'button', disabled: inUse, onclick, aria: { label: `${text}: ${name}` } },
        text,
      );
    this.save = button(inUse ? 'being written' : 'Download', () => this.#save());
    this.play = button('Play', () => this.#play());
    this.play.hidden = !name.endsWith('.bvh');
    this.part = el('div.part', { hidden: true });
    this.element = el(
      'li',
      {},
      el('strong', {}, takeName(name).text),
      el('p.note', {}, [takeName(name).stream && name, size, when].filter(Boolean).join(', ')),
      el('div.buttons', {}, this.play, this.save),
      this.part,
    );
  }

  // Whether this is what the list has now under its name.
  isOf(entry) {
    const parts = ['bytes', 'changed_unix_s', 'in_use', 'being_made', 'problem'];
    return parts.every((part) => this.file[part] === entry[part]);
  }

  #refused(why) {
    this.acks.say(`${this.file.name}: ${why}`, 'bad');
  }

  // The file; null when it cannot be had.
  async #fetch(button, text) {
    if (this.#blob) return this.#blob;
    button.disabled = true;
    const ask = (request) => this.requests.ask(request);
    const { blob, error } = await fetchRecording(ask, this.file, (share) =>
      write(button, `${Math.round(100 * share)} %`),
    );
    button.disabled = false;
    write(button, text);
    if (!blob) this.#refused(`refused: ${error}`);
    return blob ?? null;
  }

  async #save() {
    const blob = await this.#fetch(this.save, 'Download');
    if (blob) keepFile(blob, this.file.name);
  }

  async #play() {
    if (this.played.has(this.file.name)) {
      this.stop();
      return;
    }
    const blob = await this.#fetch(this.play, 'Play');
    if (!blob) return;
    try {
      this.text = await blob.text();
      this.bvh = new Bvh(this.text);
    } catch (error) {
      this.#refused(`cannot be played: ${error.message}`);
      return;
    }
    this.#blob = blob;
    if (!this.from) this.#offerPart();
    this.#start();
    this.vrma.hidden = !this.played.isBody(this.file.name); // which is what a .vrma is for
  }

  stop() {
    this.played.stop(this.file.name);
    if (this.play) this.#show();
  }

  #start() {
    const why = this.played.start(
      this.file.name,
      this.bvh,
      Number(this.from.value),
      Number(this.to.value),
    );
    if (why) this.#refused(`cannot be played: ${why}`);
    this.#show();
  }

  #show() {
    const plays = this.played.has(this.file.name);
    write(this.play, plays ? 'Stop' : 'Play');
    this.play.setAttribute('aria-label', `${plays ? 'Stop' : 'Play'}: ${this.file.name}`);
    this.part.hidden = !plays;
  }

  // From and to [s]: what is played again and again, and may be kept alone.
  #offerPart() {
    const seconds = this.bvh.seconds.toFixed(2);
    const field = (value) =>
      el('input', {
        type: 'number',
        min: 0,
        max: seconds,
        step: 0.1,
        value,
        onchange: () => this.#trim(),
      });
    this.from = field('0');
    this.to = field(seconds);
    const save = el(
      'button',
      { type: 'button', onclick: () => this.#savePart() },
      'Download this part',
    );
    this.vrma = this.#kind('vrma');
    this.part.append(
      labelled('From, s', this.from),
      labelled('To, s', this.to),
      el('div.buttons', {}, save, this.#kind('glb'), this.vrma),
    );
  }

  // The part as another kind of file, which the daemon makes.
  #kind(as) {
    const text = `As ${as.toUpperCase()}`;
    const button = el('button', { type: 'button' }, text);
    button.onclick = async () => {
      const [from_s, to_s] = [Number(this.from.value), Number(this.to.value)];
      button.disabled = true;
      const ask = (request) => this.requests.ask(request);
      const part = { as, from_s, to_s };
      const { blob, error } = await fetchRecording(ask, this.file, () => {}, part);
      button.disabled = false;
      if (blob) keepFile(blob, this.#partName(as));
      else this.#refused(`refused: ${error}`);
    };
    return button;
  }

  #partName(ending) {
    const [from_s, to_s] = [Number(this.from.value), Number(this.to.value)];
    return this.file.name.replace(/\.bvh$/, `-${from_s}s-${to_s}s.${ending}`);
  }

  #trim() {
    const { seconds, step_s } = this.bvh;
    const within = (value, low, high) => Math.min(high, Math.max(low, Number(value) || 0));
    const from_s = within(this.from.value, 0, seconds - step_s);
    this.from.value = from_s.toFixed(2);
    this.to.value = within(this.to.value, from_s + step_s, seconds).toFixed(2);
    this.#start();
  }

  #savePart() {
    const [from_s, to_s] = [Number(this.from.value), Number(this.to.value)];
    keepFile(new Blob([cutBvh(this.text, this.bvh, from_s, to_s)]), this.#partName('bvh'));
  }
}
