// The overlay that explains what is seen, and the keys.
import { TILES } from '../instruments/tiles.js';
import { el } from './dom.js';
import { DONE, swatch } from './legend.js';

const KEYS = [
  ['↑ ↓', 'choose a stream'],
  ['← →', 'less or more style'],
  ['0', 'no style'],
  ['1 2', 'view: follow the chosen one, turn round it'],
  ['3 4 5', 'view of everybody: front, side, top'],
  ['p', 'pause, and go back over the last 30 s; again: live'],
  ['r', 'raw pose: beside, as ghost, off'],
  ['t', 'trails of the feet'],
  ['g', 'write gestures; Enter plays them'],
  ['s', 'start or end a take, while posed records'],
  ['d', 'dark or light'],
  ['o', 'settings: floor, background, names, avatars'],
  ['?', 'this help'],
];

// By the legend's keys.
const SEEN = [
  ['performer', 'Published', 'what posed publishes, each performer in a colour of its own'],
  ['raw', 'Raw, translucent', 'the pose as it was captured'],
  ['contact', 'Ring', 'a foot that stands; prints stay where it stood'],
  ['predicted', 'Predicted', 'computed, because nothing came for this moment'],
  ['held', 'Held', 'the same measurement as in the frame before'],
  ['stale', 'Stale', 'nothing comes any more: the last pose'],
  ['no-value', 'No value', 'a part of the body that nobody measures now'],
  ['stopped', 'Stopped', 'links that stopped a robot'],
];

const rows = (list, tag) =>
  el(
    'dl',
    {},
    ...list.flatMap(([key, text]) => [el('dt', {}, el(tag, {}, key)), el('dd', {}, text)]),
  );

export class Help {
  // colour(): of the first performer
  constructor(dialog, button, colour) {
    Object.assign(this, { dialog, colour });
    const close = el('button', { type: 'button', onclick: () => dialog.close() }, 'Close');
    dialog.append(
      el('h2', { id: 'help-title' }, 'What you see'),
      el('p.note', {}, 'posed takes live motion, cleans it, changes its style and sends it on.'),
      el('dl', {}, ...this.#seen()),
      el('h2', {}, 'Keys'),
      rows(KEYS, 'kbd'),
      el(
        'details',
        {},
        el('summary', {}, 'What posed has done to a motion'),
        rows(Object.entries(DONE), 'span'),
      ),
      el(
        'details',
        {},
        el('summary', {}, 'What the instruments say'),
        rows(TILES, 'span'),
      ),
      el(
        'p.note',
        {},
        'Drag to turn, scroll to come closer. Drop a .vrm file on the scene: all bodies wear it.',
      ),
      close,
    );
    button.onclick = () => this.toggle();
    dialog.onclick = (event) => {
      if (event.target === dialog) dialog.close();
    };
  }

  #seen() {
    const seen = SEEN.map(([key, text]) => swatch('dt', key, el('span', {}, text)));
    [this.published] = seen;
    return SEEN.flatMap(([, , words], i) => [seen[i], el('dd', {}, words)]);
  }

  toggle() {
    if (this.dialog.open) this.dialog.close();
    else {
      this.published.style.setProperty('--own', this.colour());
      this.dialog.showModal();
      this.dialog.scrollTop = 0; // the browser shows the first button, which is the last line
    }
  }
}
