// Reads protobuf's wire format from a byte array. One reader serves all messages, so that reading a
// frame allocates nothing. A message that is cut short or damaged throws a RangeError.

const POW28 = 2 ** 28;

export class Reader {
  begin(bytes, from = 0, to = bytes.length) {
    if (this.bytes !== bytes) {
      this.bytes = bytes;
      this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    }
    this.at = from;
    this.end = to;
    return this;
  }

  more() {
    return this.at < this.end;
  }

  // The next field's number << 3 | wire type.
  tag() {
    return this.uint();
  }

  // The three parts of a varint: 28, 28 and 8 bits. A double holds 53 bits, so negative numbers
  // need the parts to stay exact.
  #parts() {
    const { bytes, end } = this;
    let low = 0;
    let middle = 0;
    let high = 0;
    for (let i = 0; i < 10; i += 1) {
      if (this.at >= end) throw new RangeError('the message ends inside a number');
      const byte = bytes[this.at];
      this.at += 1;
      const bits = byte & 127;
      if (i < 4) low += bits * 2 ** (7 * i);
      else if (i < 8) middle += bits * 2 ** (7 * (i - 4));
      else high += bits * 2 ** (7 * (i - 8));
      if (byte < 128) {
        this.low = low;
        this.middle = middle;
        this.high = high & 255;
        return;
      }
    }
    throw new RangeError('a number is longer than ten bytes');
  }

  uint() {
    // The common case: one or two bytes.
    const first = this.at < this.end ? this.bytes[this.at] : 128;
    if (first < 128) {
      this.at += 1;
      return first;
    }
    this.#parts();
    return (this.high * POW28 + this.middle) * POW28 + this.low;
  }

  // int32, int64: two's complement.
  int() {
    this.#parts();
    const high = this.high > 127 ? this.high - 256 : this.high;
    return (high * POW28 + this.middle) * POW28 + this.low;
  }

  // sint32: zigzag.
  sint() {
    const value = this.uint();
    return value % 2 === 0 ? value / 2 : -(value + 1) / 2;
  }

  bool() {
    return this.uint() !== 0;
  }

  #take(size) {
    const from = this.at;
    if (from + size > this.end) throw new RangeError('the message ends inside a value');
    this.at = from + size;
    return from;
  }

  float() {
    return this.view.getFloat32(this.#take(4), true);
  }

  double() {
    return this.view.getFloat64(this.#take(8), true);
  }

  fixed32() {
    return this.view.getUint32(this.#take(4), true);
  }

  // The length of a string, of bytes, of a packed list or of a message: it begins at `at`.
  length() {
    const size = this.uint();
    if (this.at + size > this.end) throw new RangeError('the message ends inside a field');
    return size;
  }

  string() {
    const size = this.length();
    const text = utf8.decode(this.bytes.subarray(this.at, this.at + size));
    this.at += size;
    return text;
  }

  skip(wireType) {
    if (wireType === 0) this.#parts();
    else if (wireType === 1) this.#take(8);
    else if (wireType === 2) this.#take(this.length());
    else if (wireType === 5) this.#take(4);
    else throw new RangeError(`wire type ${wireType} is unknown`);
  }
}

const utf8 = new TextDecoder();
