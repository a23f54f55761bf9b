// The folders of the daemon: its models, to use, rename and delete, and its recordings, to play and
// download. A list is asked for while it is unfolded.
import { el, write } from './dom.js';
import { Take } from './take.js';

class List {
  #listed = '';

  // context: {control, requests, acks}; each_ms: it is asked for again
  constructor(title, each_ms, context) {
    Object.assign(this, { each_ms }, context);
    this.words = el('p.note', { role: 'status' });
    this.items = el('ul.shelf');
    this.element = el(
      'details',
      { ontoggle: () => this.element.open && this.list() },
      el('summary', {}, title),
      this.words,
      this.items,
    );
  }

  // request: that lists; field: of the reply
  async show(request, field, none) {
    clearTimeout(this.timer);
    const reply = await this.requests.ask(request);
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.element.open && this.list(), this.each_ms);
    if (!reply.ok) {
      write(this.words, reply.error); // and what was listed stays
      return false;
    }
    const entries = reply[field];
    write(this.words, entries.length === 0 ? none : '');
    const listed = JSON.stringify(entries);
    if (listed === this.#listed) return true; // what somebody is about to do there stays
    this.#listed = listed;
    const items = entries.map((entry) => this.item(entry));
    const before = [...this.items.children];
    // An item that stays is not moved: it would lose the focus.
    for (const item of before) if (!items.includes(item)) item.remove();
    items.forEach((item, i) => {
      if (this.items.children[i] !== item) this.items.insertBefore(item, this.items.children[i]);
    });
    return true;
  }
}

const USERS = { style: 'a body with a style', generate: 'a hand or body that makes gestures' };
const NAMESPACE = 'http://www.w3.org/2000/svg';

// A style's mean cycle: six poses beside each other. Of what is no such drawing there is none.
function stripOf(path, name) {
  if (!/^(M-?\d+ -?\d+(L-?\d+ -?\d+)*)+$/.test(path ?? '')) return [];
  const svg = document.createElementNS(NAMESPACE, 'svg');
  const lines = document.createElementNS(NAMESPACE, 'path');
  lines.setAttribute('d', path);
  svg.setAttribute('viewBox', '0 0 570 185');
  svg.setAttribute('class', 'strip');
  svg.setAttribute('role', 'img');
  svg.setAttribute('aria-label', `Six moments of a stride as ${name} has it`);
  svg.append(lines);
  return [svg];
}

export class ModelLibrary extends List {
  // onChange(): another list of models has changed with this one
  constructor(context, onChange) {
    super('Library of models', 10000, context);
    this.onChange = onChange;
  }

  list() {
    return this.show({ list_models: {} }, 'model', 'The folder of models is empty.');
  }

  // stream: the chosen one, which a model is given to
  update(stream) {
    this.stream = stream;
    for (const button of this.items.querySelectorAll('button[data-kind]')) this.#nameUse(button);
  }

  // Says whom the model would be given to, or that it is in use there.
  #nameUse(button) {
    const { kind, model } = button.dataset;
    const stage = this.stream?.stage(kind);
    const used = stage?.model === model;
    button.setAttribute('aria-disabled', String(used)); // it keeps the focus
    const text = used ? `Used by ${this.stream.name}` : stage ? `Use for ${this.stream.name}` : 'Use';
    write(button, text);
    button.setAttribute('aria-label', `${text}: ${model}`);
  }

  item({ name, kind, learnt, skeleton, verdict, strip }) {
    const buttons = el('div.buttons');
    const row = el(
      'li',
      {},
      el('strong', {}, name),
      ...stripOf(strip, name),
      ...[learnt, skeleton && `skeleton: ${skeleton}`, verdict]
        .filter(Boolean)
        .map((text) => el('p.note', {}, text)),
      buttons,
    );
    this.#offer(buttons, name, kind);
    return row;
  }

  #offer(buttons, name, kind) {
    const button = (text, onclick) =>
      el('button', { type: 'button', onclick, aria: { label: `${text}: ${name}` } }, text);
    const use = button('Use', () => this.#use(name, kind));
    Object.assign(use.dataset, { kind, model: name });
    this.#nameUse(use);
    buttons.replaceChildren(
      use,
      button('Rename', () => this.#rename(buttons, name, kind)),
      button('Delete', () => this.#delete(buttons, name, kind)),
    );
  }

  #use(name, kind) {
    const stage = this.stream?.stage(kind);
    if (stage?.model === name) return;
    if (stage)
      this.control(
        { use_model: { stream: this.stream.name, name } },
        `${this.stream.name}: model ${name}`,
      );
    else this.acks.say(`${name} is for ${USERS[kind] ?? kind}: choose one in the list of streams`, 'bad');
  }

  // Asks in the row itself.
  #ask(buttons, name, kind, { field, what, doIt }) {
    const keep = () => {
      this.#offer(buttons, name, kind);
      buttons.firstChild.focus();
    };
    const yes = el('button.strong', { type: 'submit' }, what);
    const no = el('button', { type: 'button', onclick: keep }, 'Keep as it is');
    const form = el('form.buttons', {}, field, yes, no);
    // A key that is still held from the button before confirms nothing.
    form.onkeydown = (event) => event.repeat && event.key === 'Enter' && event.preventDefault();
    form.onsubmit = async (event) => {
      event.preventDefault();
      yes.disabled = true;
      const reply = await doIt();
      yes.disabled = false;
      if (reply.ok) await this.#changed();
      else yes.focus(); // and what was typed stays
    };
    buttons.replaceChildren(form);
    (field.focus ? form.querySelector('input, button') : yes).focus();
  }

  // Whose row has gone finds himself at the list's name.
  async #changed() {
    await this.list();
    this.onChange();
    if (document.activeElement === document.body) this.element.querySelector('summary').focus();
  }

  #rename(buttons, name, kind) {
    const field = el('input', {
      type: 'text',
      value: name.replace(/\.[a-z]+$/, ''),
      aria: { label: `New name of ${name}` },
    });
    const doIt = () =>
      this.control(
        { rename_model: { name, to: field.value } },
        `rename ${name} to ${field.value}`,
      );
    this.#ask(buttons, name, kind, { field, what: 'Rename', doIt });
  }

  #delete(buttons, name, kind) {
    const field = el('span', {}, `Delete ${name} for good?`);
    const doIt = () => this.control({ delete_model: { name } }, `delete ${name}`);
    this.#ask(buttons, name, kind, { field, what: 'Delete', doIt });
  }
}

export class Recordings extends List {
  #takes = new Map(); // by name: also while it plays and the list is made again

  constructor(context) {
    super('Recordings', 2000, context);
    this.context = context;
  }

  async list() {
    const none = 'Nothing is recorded yet. A take is here some seconds after it ends.';
    if (!(await this.show({ list_recordings: {} }, 'recording', none))) return;
    for (const [name, take] of this.#takes) {
      if (take.element.isConnected) continue;
      take.stop(); // its file has gone
      this.#takes.delete(name);
    }
  }

  item(file) {
    let take = this.#takes.get(file.name);
    if (!take?.isOf(file)) {
      take?.stop();
      take = new Take(file, this.context);
      this.#takes.set(file.name, take);
    }
    return take.element;
  }
}
