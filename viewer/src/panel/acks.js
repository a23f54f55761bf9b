// What became of the last requests, newest first; the element is a live region.
import { el } from './dom.js';

const KEPT = 3;
const SHOWN_MS = 9000;

export class Acks {
  constructor(element) {
    this.element = element;
  }

  // tone: good, bad or busy
  say(sentence, tone) {
    const ack = el('p.ack', { data: { tone } }, sentence);
    this.element.prepend(ack);
    while (this.element.children.length > KEPT) this.element.lastChild.remove();
    setTimeout(() => ack.remove(), SHOWN_MS);
  }
}

// ask(request) as `control(request, what)`: asks, shows the answer, and resolves to the reply.
export function controlWith(requests, acks) {
  return async (request, what) => {
    const began_ms = performance.now();
    const reply = await requests.ask(request);
    const took = `${Math.max(1, Math.round(performance.now() - began_ms))} ms`;
    if (!reply.ok) acks.say(`${what}: refused: ${reply.error}`, 'bad');
    else if (reply.recorder_trouble)
      acks.say(`${what}, but nothing can be written to the log: ${reply.recorder_trouble}`, 'bad');
    else if (reply.sequence > 0)
      acks.say(`${what}: applied at frame ${reply.sequence} (${took})`, 'good');
    else acks.say(`${what}: done (${took})`, 'good');
    return reply;
  };
}
