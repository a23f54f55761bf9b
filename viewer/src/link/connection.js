// The WebSocket to `posed view`: opened again whenever it closes. The first attempts follow fast,
// so that a restarted bridge is there within a second.

const FIRST_WAIT_MS = 150;
const MOST_WAIT_MS = 1000;
const REFUSED_WAIT_MS = 3000;
const MOST_QUESTION_MS = 2000; // a bridge that hangs, a network that is lost
const SILENT = 'posed view does not answer; trying again';
const CLOCK_EVERY_MS = 1000;
const MOST_UNANSWERED = 3; // the bridge answers each question about the clock at once

export class Connection {
  #socket = null;
  #wait_ms = FIRST_WAIT_MS;
  #clockTimer = 0;
  #unanswered = 0;
  #refused = false;

  // handlers: state(name, sentence), binary(bytes), text(object), open()
  constructor(token, handlers) {
    this.token = token;
    this.handlers = handlers;
    handlers.state('connecting', '');
    this.#open();
  }

  get isOpen() {
    return this.#socket?.readyState === WebSocket.OPEN;
  }

  sendText(object) {
    if (this.isOpen) this.#socket.send(JSON.stringify(object));
  }

  sendBytes(bytes) {
    if (!this.isOpen) return false;
    this.#socket.send(bytes);
    return true;
  }

  // For good: nothing is heard any more.
  close() {
    this.#socket.onopen = null;
    this.#socket.onmessage = null;
    this.#socket.onclose = null;
    this.#socket.close();
  }

  #open() {
    const scheme = location.protocol === 'https:' ? 'wss' : 'ws';
    const url = `${scheme}://${location.host}/ws?token=${encodeURIComponent(this.token)}`;
    const socket = new WebSocket(url);
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => this.#opened();
    socket.onmessage = ({ data }) => this.#received(data);
    socket.onclose = () => this.#closed();
    this.#socket = socket;
  }

  #opened() {
    this.#wait_ms = FIRST_WAIT_MS;
    this.#refused = false;
    this.#unanswered = 0;
    this.#askClock();
    this.#clockTimer = setInterval(() => this.#askClock(), CLOCK_EVERY_MS);
    this.handlers.open();
  }

  // A network that is lost, or a bridge that hangs, closes no socket.
  #askClock() {
    if (this.#unanswered === MOST_UNANSWERED) {
      this.close();
      this.#closed();
      return;
    }
    this.#unanswered += 1;
    this.sendText({ type: 'clock', t0: performance.now() });
  }

  #received(data) {
    this.#unanswered = 0;
    if (typeof data !== 'string') {
      this.handlers.binary(new Uint8Array(data));
      return;
    }
    let message;
    try {
      message = JSON.parse(data);
    } catch {
      return; // not from our bridge
    }
    this.handlers.text(message);
  }

  async #closed() {
    clearInterval(this.#clockTimer);
    const wait_ms = this.#wait_ms;
    this.#wait_ms = Math.min(1.5 * wait_ms, MOST_WAIT_MS);
    // At once: the question below may wait. Between two refusals it would only flicker.
    if (!this.#refused) this.handlers.state('closed', SILENT);
    const sentence = await this.#refusal();
    if (this.#refused && !sentence) this.handlers.state('closed', SILENT);
    this.#refused = sentence !== '';
    if (sentence) this.handlers.state('refused', sentence);
    setTimeout(() => this.#open(), sentence ? REFUSED_WAIT_MS : wait_ms);
  }

  // A WebSocket does not tell why it was refused, but the page itself is refused in the same way.
  async #refusal() {
    try {
      const page = `/?token=${encodeURIComponent(this.token)}`;
      const signal = AbortSignal.timeout(MOST_QUESTION_MS);
      const { status } = await fetch(page, { cache: 'no-store', signal });
      if (status !== 403) return '';
      return 'posed view refused this page: open the URL that it printed when it started';
    } catch {
      return ''; // it does not run
    }
  }
}
