// Calibrates the chosen glove to a hand: each pose is held and judged at once, the contacts fit the
// thumb to what it touches; alone they mend the calibration in use. Poses held once more show how
// exactly they are held. The page adds up what the sensors say, the daemon does the rest.
import { el, labelled, write } from './dom.js';

const NAME = /^[a-z0-9_-]{1,32}$/;
const isContact = (pose) => pose.startsWith('touch-');
const isAgain = (pose) => pose.endsWith('-again');
const isFirst = (pose) => !isContact(pose) && !isAgain(pose);
const POSES = [
  ['flat', 'Flat hand', 'on the table, fingers together and straight, thumb beside the index'],
  ['fist', 'Fist', 'tight, with the thumb outside'],
  ['thumb', 'Thumb across', 'fingers straight, the thumb at the root of the little finger'],
  ['spread', 'Spread hand', 'flat, all fingers as far apart as they go'],
  ['touch-index', 'Touch thumb and index', 'tip on tip, the other fingers stretched'],
  ['touch-middle', 'Touch thumb and middle', 'tip on tip, the other fingers stretched'],
  ['touch-ring', 'Touch thumb and ring finger', 'tip on tip, the other fingers stretched'],
  ['touch-little', 'Touch thumb and little finger', 'tip on tip, the other fingers stretched'],
  ['touch-fist', 'Fist, thumb across', 'tight, its tip on the middle finger'],
  ['flat-again', 'Flat hand once more', 'as the first time'],
  ['spread-again', 'Spread hand once more', 'as the first time'],
];

// What was held, by stream: also when the controls are made again.
const kept = {};

function add(sums, { name, value, validity }) {
  name.forEach((sensor, i) => {
    if (!sensor.startsWith('raw_') || !validity[i]) return;
    const key = sensor.slice(4);
    const sum = sums.get(key) ?? { sensor: key, count: 0, sum: 0, squares: 0 };
    sum.count += 1;
    sum.sum += value[i];
    sum.squares += value[i] ** 2;
    sums.set(key, sum);
  });
}

export class GloveLesson {
  static seconds = { ready: 3, hold: 2 }; // to take the pose, to hold it
  static #open = false;

  constructor({ name }, { control, requests, store }) {
    Object.assign(this, { name, control, requests, store });
    this.held = kept[name] ??= { poses: new Map(), verdicts: new Map() };
    this.rows = POSES.map(([pose, text, hint]) => this.#row(pose, text, hint));
    this.called = el('input', {
      type: 'text',
      placeholder: 'a-z, digits, - and _',
      oninput: () => this.#show(),
    });
    this.use = el('button', { type: 'button', onclick: () => this.#use() }, 'Save and use');
    this.words = el('p.note', { role: 'status' });
    this.element = el(
      'details',
      {
        open: GloveLesson.#open,
        ontoggle: () => {
          GloveLesson.#open = this.element.open;
        },
      },
      el('summary', {}, 'Calibrate this glove'),
      el(
        'p.note',
        {},
        `Press “Hold”: a countdown of ${GloveLesson.seconds.ready} s gives time to take the pose. ` +
          `Then hold it still for ${GloveLesson.seconds.hold} s; it is judged at once.`,
      ),
      ...this.#rowsOf(isFirst),
      el('p.note', {}, 'The thumb, by what it touches; these alone mend the calibration in use.'),
      ...this.#rowsOf(isContact),
      el('p.note', {}, 'Held once more, they show how exactly you hold a pose.'),
      ...this.#rowsOf(isAgain),
      labelled('Whose hand', this.called, this.use),
      this.words,
    );
    this.#show();
  }

  #rowsOf(wanted) {
    return this.rows.filter(({ pose }) => wanted(pose)).flatMap(({ row, words }) => [row, words]);
  }

  #row(pose, text, hint) {
    const hold = el('button', { type: 'button', onclick: () => this.#hold(pose, hold) }, 'Hold');
    const row = labelled(text, el('span.note', {}, hint), hold);
    hold.setAttribute('aria-label', `Hold: ${text}`);
    return { pose, hold, row, words: el('p.note', { role: 'status', data: { pose } }) };
  }

  async #wait(seconds, button, words, text) {
    words.dataset.counts = seconds > 0;
    for (let left = seconds; left > 0; left -= 1) {
      write(button, `${left} …`);
      write(words, `${text}: ${left}`);
      await new Promise((done) => {
        setTimeout(done, 1000);
      });
    }
  }

  async #hold(pose, button) {
    const { poses, verdicts } = this.held;
    this.busy = true;
    this.#show();
    const { words } = this.rows.find((row) => row.pose === pose);
    await this.#wait(GloveLesson.seconds.ready, button, words, 'Take the pose');
    const sums = new Map();
    this.store.listen(this.name, (sample) => add(sums, sample));
    await this.#wait(GloveLesson.seconds.hold, button, words, 'Hold still');
    words.dataset.counts = false;
    this.store.listen(this.name, null);
    write(button, 'Hold');
    const before = poses.get(pose);
    poses.set(pose, [...sums.values()]);
    const reply = await this.requests.ask({ fit_glove: this.#message() });
    this.busy = false;
    if (reply.ok) for (const one of reply.fit.verdict) verdicts.set(one.pose, one);
    else if (before) poses.set(pose, before);
    else poses.delete(pose);
    this.#show(reply.ok ? '' : reply.error);
  }

  #message(name = '') {
    const pose = [...this.held.poses].map(([one, held]) => ({ name: one, held }));
    return { stream: this.name, pose, name };
  }

  async #use() {
    const called = this.called.value;
    const request = { fit_glove: this.#message(called) };
    const { ok, error, fit } = await this.control(request, `${this.name}: calibration ${called}`);
    if (!ok) return this.#show(error);
    const always = `at each start: calibration = "…/${fit.file}" in the stream's table`;
    const kept = `${fit.file} is in use, and kept beside the models`;
    return this.#show(`✓ ${kept}: ${fit.sentence.join('; ')}; ${always}`);
  }

  #show(words = '') {
    const { poses, verdicts } = this.held;
    for (const { pose, hold, words: said } of this.rows) {
      const first = pose === 'flat' || isContact(pose);
      hold.disabled = this.busy || (!first && !poses.has('flat'));
      const { good, sentence } = (poses.has(pose) && verdicts.get(pose)) || {};
      write(said, sentence ? `${good ? '✓' : '✗'} ${sentence}` : '');
    }
    const held = [...poses.keys()];
    const whole = POSES.every(([pose]) => !isFirst(pose) || poses.has(pose));
    const thumb = held.length > 0 && held.every(isContact);
    const good = (whole || thumb) && held.every((pose) => verdicts.get(pose)?.good);
    this.use.disabled = this.busy || !good || !NAME.test(this.called.value);
    const { value } = this.called;
    const unfit = value && !NAME.test(value) ? 'The name has a-z, 0-9, - and _, at most 32.' : '';
    write(this.words, words || unfit);
  }
}
