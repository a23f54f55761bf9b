// The controls of the chosen stream: those that its stages have. Made again when the stages or
// their models change; their values follow the statistics.
import { el, write } from './dom.js';
import { GestureControls } from './gesture_controls.js';
import { GloveLine, isGlove } from './glove.js';
import { GloveLesson } from './glove_lesson.js';
import { ModelControls } from './model_controls.js';
import { Parameters } from './parameters.js';
import { SignLesson } from './sign_lesson.js';
import { StyleControls } from './style_controls.js';
import { TeachControls } from './teach_controls.js';

// What the controls depend on.
function shapeOf({ name, stats }) {
  const stages = stats.stage.map(({ name: stage, parameter, word }) => [
    stage,
    parameter.map((one) => one.name),
    stage === 'style' ? word : word.length > 0,
  ]);
  return JSON.stringify([name, stages, stats.device_info !== '']);
}

export class Chosen {
  #shape = '';
  #parts = [];

  // context: {control, requests, acks, store}; endpoint(): the daemon's, for commands
  constructor(element, context, endpoint) {
    this.element = element;
    this.context = context;
    this.endpoint = endpoint;
    this.reason = el('p.reason', { hidden: true });
    this.fields = el('fieldset.controls');
  }

  clear() {
    this.#shape = '';
    this.#parts = [];
    this.element.replaceChildren();
  }

  update(stream, readOnlyReason) {
    if (!stream?.stats) {
      this.clear();
      return;
    }
    const shape = shapeOf(stream);
    if (shape !== this.#shape) this.#make(stream);
    this.#shape = shape;
    const wasOff = this.fields.disabled;
    this.fields.disabled = readOnlyReason !== '';
    if (wasOff && !this.fields.disabled) this.listModels();
    this.reason.hidden = readOnlyReason === '';
    write(this.reason, readOnlyReason && `Controls are off: ${readOnlyReason}`);
    for (const part of this.#parts) part.update?.(stream);
  }

  listModels() {
    for (const part of this.#parts) part.list?.();
  }

  #make(stream) {
    const { control } = this.context;
    const find = (name) => stream.stage(name);
    this.style = find('style') ? new StyleControls(stream, control) : null;
    this.gesture = find('generate')?.word.length > 0 ? new GestureControls(stream, control) : null;
    const models = ['style', 'generate']
      .filter(find)
      .map((kind) => new ModelControls(stream, kind, this.context));
    const teach = find('style') ? new TeachControls(stream, this.context) : null;
    const signs = find('generate') && stream.isHand ? new SignLesson(stream, this.context) : null;
    this.lesson = teach ?? signs;
    this.glove = isGlove(stream) ? new GloveLesson(stream, this.context) : null;
    const more = new Parameters(stream, control);
    this.#parts = [this.style, this.gesture, ...models, teach, signs, this.glove, more].filter(
      (part) => part !== null,
    );
    const glove = isGlove(stream) ? [new GloveLine(stream, this.endpoint())] : [];
    this.fields.replaceChildren(...this.#parts.map((part) => part.element));
    this.element.replaceChildren(
      el('h2', {}, stream.name),
      this.reason,
      this.fields,
      ...glove.map((part) => part.element),
    );
  }

  // After each animation frame.
  mark(stream) {
    this.gesture?.mark(stream.pose);
  }
}
