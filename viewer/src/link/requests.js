// Control requests and their answers. Each has a number; the daemon's answer comes back with it.
import { ControlReply, ControlRequest } from '../wire/schema.js';
import { decode, encode } from '../wire/message.js';

const HEAD_BYTES = 4; // the request's number, little-endian
const PATIENCE_MS = 8000; // longer than the bridge's own

export class Requests {
  #waiting = new Map(); // number: {done, timer}
  #last = 0;

  // sendBytes(bytes): false when there is no connection
  constructor(sendBytes) {
    this.sendBytes = sendBytes;
  }

  // Resolves to a ControlReply; never rejects: what went wrong is a reply that is not ok.
  ask(request) {
    this.#last += 1;
    const number = this.#last;
    const body = encode(ControlRequest, request);
    const bytes = new Uint8Array(HEAD_BYTES + body.length);
    new DataView(bytes.buffer).setUint32(0, number, true);
    bytes.set(body, HEAD_BYTES);
    if (!this.sendBytes(bytes)) return Promise.resolve(failed('there is no connection to posed'));
    return new Promise((done) => {
      const timer = setTimeout(() => this.#finish(number, failed('no answer came')), PATIENCE_MS);
      this.#waiting.set(number, { done, timer });
    });
  }

  reply(number, bytes, from) {
    this.#finish(number, decode(ControlReply, bytes, from));
  }

  refused(number, sentence) {
    this.#finish(number, failed(sentence));
  }

  // The connection is gone: no answer will come.
  abandon() {
    for (const number of [...this.#waiting.keys()]) {
      this.#finish(number, failed('the connection broke; it may have taken effect'));
    }
  }

  #finish(number, reply) {
    const waiting = this.#waiting.get(number);
    if (!waiting) return;
    this.#waiting.delete(number);
    clearTimeout(waiting.timer);
    waiting.done(reply);
  }
}

const failed = (error) => ({ ok: false, error, stream: '', sequence: 0, model: [] });
