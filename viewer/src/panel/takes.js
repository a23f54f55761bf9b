// Takes: marks in the recording. Shown while the daemon records.
import { el, write } from './dom.js';

const LONGEST_NAME = 128;

export class Takes {
  #running = false;

  constructor(form, control) {
    this.form = form;
    this.control = control;
    this.name = el('input', {
      type: 'text',
      maxLength: LONGEST_NAME,
      placeholder: 'take name',
      aria: { label: 'Take name' },
    });
    this.button = el('button', { type: 'submit' }, 'Start take');
    this.words = el('span.recording');
    this.fields = el('fieldset', {}, this.name, this.button);
    form.append(this.words, this.fields);
    form.onsubmit = (event) => {
      event.preventDefault();
      this.toggle();
    };
  }

  toggle() {
    if (this.form.hidden || this.fields.disabled) return;
    const start = !this.#running;
    const name = start ? this.name.value.trim() : '';
    this.control(
      { take: { start, name } },
      start ? `take ${name || 'without a name'} begins` : 'take ends',
    );
  }

  update(stats, readOnlyReason) {
    this.form.hidden = !stats || stats.recorder_file === '';
    if (this.form.hidden) return;
    this.#running = stats.take !== undefined;
    this.fields.disabled = readOnlyReason !== '';
    this.fields.title = readOnlyReason;
    this.name.hidden = this.#running;
    write(this.button, this.#running ? 'End take' : 'Start take');
    this.form.dataset.running = this.#running;
    write(this.words, this.#words(stats));
    this.words.title = stats.recorder_file;
  }

  #words({ take, recorder_lost_chunks: lost, recorder_errors: errors }) {
    const trouble = errors > 0 || lost > 0 ? `, ${errors} errors, ${lost} chunks lost` : '';
    if (!take) return `recording${trouble}`;
    return `take ${take.number}${take.name ? ` “${take.name}”` : ''}${trouble}`;
  }
}
