// The line that calibrates a glove in a terminal.
import { el, write } from './dom.js';

export class GloveLine {
  constructor(stream, endpoint) {
    const text =
      `posed calibrate --connect ${endpoint} --stream ${stream.name}` +
      ' --user ann --out ann.toml';
    this.line = el('code', { tabIndex: 0 }, text);
    this.button = el('button.quiet', { type: 'button', onclick: () => this.#copy(text) }, 'Copy');
    this.element = el(
      'div.group',
      {},
      el('p.note', {}, 'The same in a terminal:'),
      el('div.copy', {}, this.line, this.button),
    );
  }

  async #copy(text) {
    try {
      await navigator.clipboard.writeText(text);
      write(this.button, 'Copied');
    } catch {
      getSelection().selectAllChildren(this.line);
      write(this.button, 'Press Ctrl+C');
    }
    setTimeout(() => write(this.button, 'Copy'), 2000);
  }
}

export const isGlove = ({ stats }) => (stats?.device_info ?? '') !== '';
