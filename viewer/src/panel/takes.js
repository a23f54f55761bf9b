// Takes: marks in the recording. A daemon that does not record, or replays, has none: then the page
// says what to do.
import { takeTitle } from '../streams/played.js';
import { el, write } from './dom.js';
import { minutes } from './numbers.js';

const MAX_NAME_BYTES = 128;
const bytesOf = (text) => new TextEncoder().encode(text).length;
const HOW =
  'To keep takes, name a folder for them in its config ([control] recordings = "takes") and start' +
  ' it again, or use `posed record` in place of `posed run`.';

export class Takes {
  #running = false;
  #records = false;
  #asking = false;
  #stats = null; // the last that were read: an answer is newer than those

  // say(sentence, tone): for who asks for a take where none can be
  constructor(form, control, say) {
    Object.assign(this, { form, control, say });
    this.name = el('input', {
      type: 'text',
      placeholder: 'take name',
      oninput: () => {
        while (bytesOf(this.name.value) > MAX_NAME_BYTES)
          this.name.value = [...this.name.value].slice(0, -1).join('');
      },
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

  // The answer says whether a take runs: the next statistics come up to a second later.
  async toggle() {
    const obstacle = this.#obstacle();
    if (obstacle) this.say(obstacle, 'bad');
    if (obstacle || this.#asking) return;
    this.#asking = true;
    const start = !this.#running;
    const name = start ? this.name.value.trim() : '';
    const reply = await this.control(
      { take: { start, name } },
      start ? `take ${name || 'without a name'} begins` : 'take ends',
    );
    this.#asking = false;
    if (reply.ok) this.#run(start);
  }

  #obstacle() {
    if (this.form.hidden) return 'no take begins: a replay is not recorded';
    if (!this.#records) return `no take begins, because posed does not record. ${HOW}`;
    return this.fields.disabled ? `no take begins: ${this.fields.title}` : '';
  }

  update(stats, readOnlyReason) {
    this.form.hidden = !stats || stats.replay_file !== '';
    if (this.form.hidden) return;
    this.#records = stats.recorder_file !== '';
    this.form.dataset.recording = this.#records;
    if (!this.#records) {
      this.#run(false);
      this.name.hidden = true;
      this.fields.disabled = false; // the button says what to do
      this.fields.title = '';
      this.form.dataset.trouble = false;
      write(this.words, 'not recording');
      this.words.title = HOW;
      return;
    }
    if (stats !== this.#stats) this.#run(stats.take !== undefined);
    this.#stats = stats;
    this.fields.disabled = readOnlyReason !== '';
    this.fields.title = readOnlyReason;
    write(this.words, this.#words(stats));
    this.words.title =
      stats.recorder_trouble ||
      `Everything is recorded, into ${stats.recorder_file}. A take marks a part, which becomes a clip.`;
    this.form.dataset.trouble = stats.recorder_trouble !== '';
  }

  #run(running) {
    this.#running = running;
    this.name.hidden = running;
    write(this.button, running ? 'End take' : 'Start take');
    this.form.dataset.running = running;
  }

  // While no take runs posed records, too: a take only marks a part of it.
  #words(stats) {
    const { take, recorder_lost_chunks: lost, recorder_errors: errors, recorder_trouble: trouble } = stats;
    const now = trouble ? ', NOTHING IS WRITTEN' : '';
    const missing = errors > 0 || lost > 0 ? `, ${errors} errors, ${lost} chunks lost` : '';
    const clock = take ? ` ${minutes((stats.time_ns - take.start_ns) / 1e9)}` : '';
    return `${take ? takeTitle(take.number, take.name) : 'recording, no take begun'}${clock}${now}${missing}`;
  }
}
