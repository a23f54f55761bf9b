// The settings of the scene in one place: what is around the figures, how they are drawn, and which
// avatar each performer wears. All of it is remembered by the browser.
import { BONES } from '../scene/avatars.js';
import { el, labelled } from './dom.js';
import { keep, kept } from './settings.js';

const AS_ALL = '*'; // no file is named so
const CHOICES = {
  background: {
    text: 'Background',
    values: {
      page: 'as the page',
      light: 'light',
      dark: 'dark',
      plain: 'plain grey',
      green: 'green, to key out',
    },
  },
  quality: {
    text: 'Picture',
    values: { auto: 'as sharp as it stays fluent', sharp: 'always sharp', quick: 'always quick' },
  },
};
const SWITCHES = { floor: 'Floor', names: 'Names' };

export class SettingsPanel {
  #listed = '';

  constructor(element, button, world, avatars) {
    Object.assign(this, { element, button, world, avatars });
    this.file = el('input', {
      type: 'file',
      accept: '.vrm,.glb',
      hidden: true,
      aria: { label: 'Avatar file' },
      onchange: () => this.#picked(),
    });
    this.figures = el('div.figures');
    element.append(
      el(
        'header.settings-head',
        {},
        el('h2', {}, 'Settings'),
        el('button.quiet', { type: 'button', onclick: () => this.toggle() }, 'Close'),
      ),
      ...Object.keys(SWITCHES).map((name) => this.#switch(name)),
      ...Object.keys(CHOICES).map((name) => this.#choice(name)),
      el('h3', {}, 'Avatars'),
      this.figures,
      el(
        'p.note',
        {},
        'An avatar is a VRM file, .vrm or .glb. This browser keeps it; it is sent nowhere.',
      ),
      this.file,
    );
    button.onclick = () => this.toggle();
    element.addEventListener('keydown', (event) => {
      if (event.key === 'Escape') this.toggle();
    });
    this.#say();
  }

  toggle() {
    this.element.hidden = !this.element.hidden;
    this.#say();
    if (this.element.hidden) this.button.focus();
    else this.element.querySelector('input, select').focus();
  }

  #say() {
    this.button.setAttribute('aria-expanded', String(!this.element.hidden));
  }

  #switch(name) {
    const box = el('input', { type: 'checkbox', checked: kept(name) !== 'off' });
    const set = () => this.world.setOption(name, box.checked);
    box.onchange = () => {
      keep(name, box.checked ? 'on' : 'off');
      set();
    };
    set();
    return el('label.check', {}, box, SWITCHES[name]);
  }

  #choice(name) {
    const { text, values } = CHOICES[name];
    const select = el(
      'select',
      {},
      ...Object.entries(values).map(([value, words]) => el('option', { value }, words)),
    );
    const before = kept(name);
    select.value = before in values ? before : Object.keys(values)[0];
    const set = () => this.world.setOption(name, select.value);
    select.onchange = () => {
      keep(name, select.value);
      set();
    };
    set();
    return labelled(text, select);
  }

  // The streams or the avatars may be others.
  update() {
    const { avatars, world } = this;
    const bodies = world.store
      .main()
      .filter(({ isHand }) => !isHand)
      .map(({ name }) => name);
    const shown = ['', ...bodies].map((stream) => [stream, avatars.chosen(stream)]);
    const now = JSON.stringify([shown, avatars.names]);
    if (now === this.#listed) return;
    this.#listed = now;
    const own = avatars.names.filter((name) => avatars.isOwn(name));
    this.figures.replaceChildren(
      ...shown.map(([stream, name]) => this.#figure(stream, name)),
      ...own.map((name) => this.#own(name)),
    );
  }

  #figure(stream, chosen) {
    const { avatars } = this;
    const option = (value, text) => el('option', { value }, text);
    const select = el(
      'select',
      {},
      stream ? option(AS_ALL, 'as all') : null,
      ...avatars.names.map((name) => option(name, name)),
      option(BONES, 'bones'),
    );
    select.value = chosen ?? AS_ALL;
    select.onchange = () =>
      avatars.wear(select.value === AS_ALL ? null : select.value, stream);
    const who = stream || 'All bodies';
    const file = el(
      'button.quiet',
      { type: 'button', aria: { label: `Avatar from a file: ${who}` } },
      'File …',
    );
    file.onclick = () => {
      this.picks = stream;
      this.file.click();
    };
    return labelled(who, select, file);
  }

  #own(name) {
    const forget = () => this.avatars.forget(name);
    return el(
      'p.note',
      {},
      `${name} is kept here. `,
      el('button.quiet', { type: 'button', onclick: forget }, `Forget ${name}`),
    );
  }

  async #picked() {
    const [file] = this.file.files;
    this.file.value = '';
    if (file) await this.avatars.take(file, this.picks);
  }
}
