// Sends the newest value only: while one is on its way, later ones replace each other. A slider
// that is dragged so never runs ahead of the daemon.

export class Latest {
  #busy = false;
  #next = undefined;

  // send(value): a promise
  constructor(send) {
    this.send = send;
  }

  get busy() {
    return this.#busy;
  }

  async put(value) {
    this.#next = { value };
    if (this.#busy) return;
    this.#busy = true;
    while (this.#next) {
      const { value: newest } = this.#next;
      this.#next = undefined;
      await this.send(newest);
    }
    this.#busy = false;
  }
}
