// The overlay that explains what is seen, and the keys.
import { TILES } from '../instruments/tiles.js';
import { el } from './dom.js';

const KEYS = [
  ['↑ ↓', 'choose a stream'],
  ['← →', 'less or more style'],
  ['0', 'no style'],
  ['1 2', 'view: follow the chosen one, turn round it'],
  ['3 4 5', 'view of everybody: front, side, top'],
  ['p', 'pause, and go back over the last 30 s; again: live'],
  ['r', 'raw pose: beside, as ghost, off'],
  ['t', 'trails of the feet'],
  ['g', 'write gestures to perform; Enter plays them'],
  ['s', 'start or end a take, while posed records'],
  ['d', 'dark or light'],
  ['o', 'settings: floor, background, names, avatars'],
  ['?', 'this help'],
];

const SEEN = [
  ['Coloured figure', 'what posed publishes, each performer in a colour of its own'],
  ['Grey, translucent figure', 'the raw pose, as it was captured'],
  ['Green ring', 'a foot that stands; prints stay where it stood'],
  ['Orange, purple, grey', 'a pose that is predicted, held or stale; the name says so, too'],
  ['Red part', 'a part of the body without a value'],
];

const rows = (list, tag) =>
  el(
    'dl',
    {},
    ...list.flatMap(([key, text]) => [el('dt', {}, el(tag, {}, key)), el('dd', {}, text)]),
  );

export class Help {
  constructor(dialog, button) {
    this.dialog = dialog;
    const close = el('button', { type: 'button', onclick: () => dialog.close() }, 'Close');
    dialog.append(
      el('h2', { id: 'help-title' }, 'What you see'),
      rows(SEEN, 'span'),
      el('h2', {}, 'Keys'),
      rows(KEYS, 'kbd'),
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

  toggle() {
    if (this.dialog.open) this.dialog.close();
    else {
      this.dialog.showModal();
      this.dialog.scrollTop = 0; // the browser shows the first button, which is the last line
    }
  }
}
