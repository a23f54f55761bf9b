// The buttons above the scene: views, the raw figures, trails, pictures.
import { VIEWS } from '../scene/views.js';
import { el, write } from './dom.js';
import { keep, kept } from './settings.js';

const RAW = ['beside', 'under', 'off'];
const RAW_WORDS = { beside: 'Raw: beside', under: 'Raw: as ghost', off: 'Raw: off' };
const word = (name) => name[0].toUpperCase() + name.slice(1);

export class Tools {
  #views = new Map();

  // capture: of pictures
  constructor(element, world, capture) {
    this.world = world;
    this.raw = el('button', {
      type: 'button',
      onclick: () => this.nextRaw(),
      title: 'The pose as captured (r)',
    });
    this.trails = el(
      'button',
      {
        type: 'button',
        onclick: () => this.toggleTrails(),
        title: 'Paths and prints of the feet (t)',
      },
      'Trails',
    );
    for (const [i, view] of VIEWS.entries()) {
      const button = el(
        'button',
        { type: 'button', onclick: () => world.views.set(view), title: `${word(view)} (${i + 1})` },
        word(view),
      );
      this.#views.set(view, button);
    }
    const picture = el(
      'button',
      { type: 'button', onclick: () => capture.picture(), title: 'Keep the scene as PNG' },
      'Screenshot',
    );
    const video = el(
      'button',
      {
        type: 'button',
        title: 'Keep ten seconds of the scene as WebM',
        aria: { pressed: 'false' },
      },
      'Video 10 s',
    );
    video.onclick = () =>
      capture.video((records) => {
        write(video, records ? 'Stop video' : 'Video 10 s');
        video.setAttribute('aria-pressed', String(records));
      });
    element.append(
      el('div.joined', {}, ...this.#views.values()),
      el('div.joined', {}, this.raw, this.trails),
      el('div.joined', {}, picture, video),
    );
    world.onView = (name) => this.#mark(name);
    this.#mark(world.views.name);
    this.setRaw(RAW.includes(kept('raw')) ? kept('raw') : 'beside');
    this.#setTrails(kept('trails') !== 'off');
  }

  #mark(name) {
    for (const [view, button] of this.#views)
      button.setAttribute('aria-pressed', String(view === name));
  }

  nextRaw() {
    this.setRaw(RAW[(RAW.indexOf(this.world.options.raw) + 1) % RAW.length]);
  }

  setRaw(mode) {
    this.world.setOption('raw', mode);
    write(this.raw, RAW_WORDS[mode]);
    this.raw.setAttribute('aria-pressed', String(mode !== 'off'));
    keep('raw', mode);
  }

  toggleTrails() {
    this.#setTrails(!this.world.options.trails);
  }

  #setTrails(on) {
    this.world.setOption('trails', on);
    this.trails.setAttribute('aria-pressed', String(on));
    keep('trails', on ? 'on' : 'off');
  }
}
