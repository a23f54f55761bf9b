// Light or dark: as the system has it, until a person chooses.
import { kept, keep } from './settings.js';

const ICONS = { light: '☾', dark: '☀' };

export class Theme {
  constructor(button, onChange) {
    this.button = button;
    this.onChange = onChange;
    this.system = matchMedia('(prefers-color-scheme: dark)');
    this.system.addEventListener('change', () => this.#apply());
    button.onclick = () => this.toggle();
    this.#apply();
  }

  get name() {
    return kept('theme') ?? (this.system.matches ? 'dark' : 'light');
  }

  toggle() {
    keep('theme', this.name === 'dark' ? 'light' : 'dark');
    this.#apply();
  }

  #apply() {
    document.documentElement.dataset.theme = this.name;
    this.button.textContent = ICONS[this.name];
    this.button.title = `${this.name === 'dark' ? 'Light' : 'Dark'} colours (d)`;
    this.onChange?.(this.name);
  }
}
