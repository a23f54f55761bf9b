// The model of a stage: one of the daemon's list, or a file of one's own.
import { sendModel } from '../link/upload.js';
import { el, labelled, write } from './dom.js';

const ASK_AGAIN_MS = 5000; // for a list that was refused or did not come
const NONE = 'none'; // as the daemon has it: the stream uses no model any more
const NO_LIST = 'the daemon offers no list: [control] models names a folder';

export class ModelControls {
  // By stream and stage {now, before}, also when the controls are made again.
  static #used = new Map();
  element = el('div.group');

  // kind: the stage that uses it, style or generate
  constructor(stream, kind, { control, requests, acks }) {
    Object.assign(this, { name: stream.name, kind, control, requests, acks });
    this.choice = el('select', { onchange: () => this.#use(this.choice.value) });
    this.file = el('input', { type: 'file', hidden: true, onchange: () => this.#send() });
    this.progress = el('progress', { max: 1, value: 0, hidden: true });
    const pick = el('button', { type: 'button', onclick: () => this.file.click() }, 'File …');
    this.back = el('button', {
      type: 'button',
      hidden: true,
      title: 'The model before; again: this one. So they are compared',
      onclick: () => this.#use(this.back.value),
    });
    this.element.append(labelled('Model', this.choice, pick), this.back, this.file, this.progress);
    this.list();
  }

  // Asks for the daemon's list; again when the page may control what it could not before.
  async list() {
    this.askedAt_ms = performance.now();
    const reply = await this.requests.ask({ list_models: {} });
    this.refusal = reply.ok ? '' : `no list of models: ${reply.error}`;
    this.names = (reply.ok ? reply.model : [])
      .filter(({ kind }) => kind === this.kind)
      .map(({ name }) => name);
    this.#fill();
  }

  #fill() {
    const names = this.names ?? [];
    const all = names.includes(this.current) || !this.current ? names : [this.current, ...names];
    const none = this.current
      ? [el('option', { value: NONE }, 'none')]
      : [el('option', { value: '' }, `none in use${names.length > 0 ? `, ${names.length} to choose` : ''}`)];
    this.choice.replaceChildren(
      ...none,
      ...all.map((name) => el('option', { value: name }, name)),
    );
    this.choice.value = this.current ?? '';
    this.choice.disabled = names.length === 0 && !this.current;
    this.choice.title = names.length === 0 ? this.refusal || NO_LIST : '';
    const { before = '' } = ModelControls.#used.get(this.#key) ?? {};
    this.back.hidden = !names.includes(before); // a file that was sent is nowhere to be had again
    this.back.value = before;
    write(this.back, `Back to ${before}`);
  }

  get #key() {
    return `${this.kind} ${this.name}`;
  }

  #remember(model) {
    const used = ModelControls.#used.get(this.#key);
    if (used?.now !== model)
      ModelControls.#used.set(this.#key, { now: model, before: used?.now ?? '' });
  }

  async #use(value) {
    const reply = await this.control(
      { use_model: { stream: this.name, name: value, stage: value === NONE ? this.kind : '' } },
      `${this.name}: model ${value}`,
    );
    if (!reply.ok) this.#fill();
  }

  async #send() {
    const [file] = this.file.files;
    this.file.value = '';
    if (!file) return;
    this.progress.hidden = false;
    const bytes = new Uint8Array(await file.arrayBuffer());
    const ask = (request) => this.requests.ask(request);
    const reply = await sendModel(ask, this.name, file.name, bytes, (share) => {
      this.progress.value = share;
    });
    this.progress.hidden = true;
    const what = `${this.name}: model ${file.name}`;
    if (reply.ok) this.acks.say(`${what}: applied at frame ${reply.sequence}`, 'good');
    else this.acks.say(`${what}: refused: ${reply.error}`, 'bad');
  }

  update(stream) {
    if (this.refusal && performance.now() - this.askedAt_ms > ASK_AGAIN_MS) this.list();
    const model = stream.stage(this.kind)?.model ?? '';
    if (model === this.current) return;
    this.current = model;
    this.#remember(model);
    this.#fill();
    if (model && !this.names?.includes(model)) this.list(); // it may be one that was just taught
  }
}
