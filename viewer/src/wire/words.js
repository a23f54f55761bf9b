// Short ASCII texts that come again and again (topics, labels): each is decoded once, then found by
// its bytes, so that a frame makes no new strings. Bounded: a flood of new words empties it.

const MOST = 512;

export class Words {
  #known = new Map();

  at(bytes, from, size) {
    let hash = size;
    for (let i = from; i < from + size; i += 1) hash = (hash * 31 + bytes[i]) | 0;
    const text = this.#known.get(hash);
    if (text !== undefined && same(text, bytes, from, size)) return text;
    const fresh = utf8.decode(bytes.subarray(from, from + size));
    if (this.#known.size >= MOST) this.#known.clear();
    this.#known.set(hash, fresh);
    return fresh;
  }
}

function same(text, bytes, from, size) {
  if (text.length !== size) return false;
  for (let i = 0; i < size; i += 1) {
    if (text.charCodeAt(i) !== bytes[from + i]) return false;
  }
  return true;
}

const utf8 = new TextDecoder();
