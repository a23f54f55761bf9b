// "Use my camera": hands without a glove. The browser finds them; 21 points a hand go to posed.
import { Camera, cameras, wordsOf } from '../camera/camera.js';
import { landmarksMessage } from '../camera/hands_of.js';
import { el, write } from './dom.js';

const CONSENT =
  'The picture stays in this browser; only 21 points a hand are sent to posed on this computer.';
const LOADING = 'loading what finds hands (13 MB)';
const STARTING = 'starting the camera';
const NO_HAND = 'no hand is seen: hold one up, palm to the camera';
const HIDDEN = 'stopped, because the page was hidden';
const OFF = 'the camera is off: posed gets no hand of it';
const SECOND_MS = 1000;
const KEPT_AGES = 100;
const FINGERS = [0, 1, 2, 3, 4].map((f) => [0, 1, 2, 3, 4].map((j) => (j ? 4 * f + j : 0)));
const SIDES = [
  ['', 'automatic'],
  ['left', 'left'],
  ['right', 'right'],
];

export class CameraPanel {
  #refusal = '';
  #times_ms = []; // of the pictures of the last second
  #said = '';
  #starting = null; // this start, until it has succeeded, failed or been stopped
  readOnly = '';
  // Of the pictures since the start; the ages are those of the last ones.
  frames = 0;
  found = 0;
  ages_ms = [];

  // send(message): gives it to posed
  constructor(send) {
    this.send = send;
    this.video = el('video', { muted: true, playsInline: true, aria: { hidden: 'true' } });
    this.canvas = el('canvas', { role: 'img', aria: { label: 'The points that were found' } });
    this.preview = el('div.camera-preview', { hidden: true }, this.video, this.canvas);
    this.button = el('button', { type: 'button', onclick: () => this.toggle() }, 'Use my camera');
    this.device = el('select', { aria: { label: 'Camera' }, hidden: true });
    this.side = el(
      'select',
      { aria: { label: 'Which hand it is' } },
      ...SIDES.map(([value, text]) => el('option', { value }, text)),
    );
    this.words = el('p.camera-words', { role: 'status' });
    this.options = el(
      'p.camera-options',
      { hidden: true },
      this.device,
      el('label', {}, 'Which hand: ', this.side),
    );
    this.element = el(
      'section.camera',
      { hidden: true, aria: { label: 'Your hand by webcam' } },
      el('h2', {}, 'Your hand by webcam'),
      this.button,
      el('p.camera-consent', {}, `${CONSENT} Hands only, experimental.`),
      this.options,
      this.preview,
      this.words,
    );
    this.device.onchange = () => this.#start();
    this.camera = new Camera(this.video, {
      found: (found) => this.#found(found),
      ended: (sentence) => this.#ended(sentence),
    });
    // Who comes near the button probably wants the camera.
    for (const near of ['pointerenter', 'focusin'])
      this.element.addEventListener(near, () => this.readOnly || this.camera.prepare());
    document.addEventListener('visibilitychange', () => document.hidden && this.#leave());
    addEventListener('pagehide', () => this.#leave());
  }

  // hello: the bridge's greeting; null while there is no connection.
  update(hello, readOnly) {
    if (hello) this.element.hidden = !hello.camera || !hello.same_machine || !navigator.mediaDevices;
    this.readOnly = readOnly;
    this.button.disabled = readOnly !== '';
    this.button.title = readOnly;
    if (readOnly) this.stop(readOnly);
  }

  // The bridge does not pass the hands on.
  told({ refusal }) {
    this.#refusal = refusal;
    setTimeout(() => this.#refusal === refusal && (this.#refusal = ''), 2 * SECOND_MS);
  }

  toggle() {
    if (this.camera.running) this.stop(OFF);
    else this.#start();
  }

  stop(sentence = '') {
    if (!this.camera.running && !this.#starting) return;
    this.camera.stop(); // also while the browser asks the user
    this.#ended(sentence);
  }

  #ended(sentence) {
    this.#starting = null;
    this.button.disabled = this.readOnly !== '';
    this.#show(sentence);
  }

  #leave() {
    this.stop(HIDDEN);
    this.camera.forget();
  }

  async #start() {
    this.#said = '';
    this.#refusal = '';
    this.frames = 0;
    this.found = 0;
    const words = this.camera.isReady ? STARTING : LOADING;
    write(this.words, words);
    this.button.disabled = true;
    const start = {};
    this.#starting = start;
    try {
      await this.camera.start(this.device.value);
      if (this.#starting !== start) return;
      this.#show(words);
      await this.#listDevices();
    } catch (error) {
      if (this.#starting !== start) return;
      this.stop(wordsOf(error));
    }
    if (this.#starting !== start) return;
    this.#starting = null;
    this.button.disabled = this.readOnly !== '';
  }

  // Their names are known once a camera is in use.
  async #listDevices() {
    const chosen = this.device.value;
    const all = await cameras();
    this.device.replaceChildren(
      ...all.map(({ deviceId, label }, i) =>
        el('option', { value: deviceId }, label || `camera ${i + 1}`),
      ),
    );
    if (chosen) this.device.value = chosen;
    this.device.hidden = all.length < 2;
  }

  #show(sentence) {
    const { running } = this.camera;
    this.preview.hidden = !running;
    this.options.hidden = !running;
    write(this.button, running ? 'Stop the camera' : 'Use my camera');
    write(this.words, sentence);
  }

  #found({ hands, time_ms, picture }) {
    const now_ms = performance.now();
    this.frames += 1;
    if (hands.length > 0) this.found += 1;
    this.ages_ms = [...this.ages_ms, now_ms - time_ms].slice(-KEPT_AGES);
    this.send(landmarksMessage(hands, { time_ms, side: this.side.value }));
    this.#draw(picture, hands);
    picture.close();
    this.#times_ms = this.#times_ms.filter((then_ms) => now_ms - then_ms < SECOND_MS);
    this.#times_ms.push(now_ms);
    const rate = `${this.#times_ms.length} pictures a second, ${Math.round(now_ms - time_ms)} ms old`;
    // Not whose: the stream says which side it is, from all the pictures.
    const seen = [NO_HAND, 'one hand is seen'][hands.length] ?? 'two hands are seen';
    const words = this.#refusal || `${seen} (${rate})`;
    if (words !== this.#said) write(this.words, words);
    this.#said = words;
  }

  // The picture in which these points were found.
  #draw(picture, hands) {
    const { canvas } = this;
    if (canvas.width !== picture.width) canvas.width = picture.width;
    if (canvas.height !== picture.height) canvas.height = picture.height;
    const pen = canvas.getContext('2d');
    pen.drawImage(picture, 0, 0);
    pen.lineWidth = canvas.width / 160;
    for (const { side, picture } of hands) {
      pen.strokeStyle = side === 'left' ? '#e69f00' : '#56b4e9'; // Okabe and Ito
      pen.beginPath();
      for (const finger of FINGERS) {
        finger.forEach((at, i) => {
          const [x, y] = picture[at];
          if (i === 0) pen.moveTo(x * canvas.width, y * canvas.height);
          else pen.lineTo(x * canvas.width, y * canvas.height);
        });
      }
      pen.stroke();
    }
  }
}
