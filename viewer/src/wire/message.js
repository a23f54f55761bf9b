// Messages by the tables of schema.js: from bytes to an object and back. For everything that comes
// at most a few times a second.
import { Reader } from './reader.js';

const NUMBERS = new Set(['uint', 'int', 'sint', 'bool', 'float', 'double', 'fixed32']);
const WIRE_TYPE = { uint: 0, int: 0, sint: 0, bool: 0, double: 1, float: 5, fixed32: 5 };

const typeOf = (type) => WIRE_TYPE[type] ?? 2;

function defaults(table) {
  const message = {};
  for (const [name, type, many] of Object.values(table)) {
    if (many === '*') message[name] = [];
    else if (many === '?') message[name] = undefined;
    else if (type === 'bool') message[name] = false;
    else message[name] = NUMBERS.has(type) ? 0 : '';
  }
  return message;
}

function value(reader, type) {
  if (type === 'bytes') {
    const size = reader.length();
    reader.at += size;
    return reader.bytes.subarray(reader.at - size, reader.at);
  }
  if (typeof type === 'string') return reader[type]();
  const size = reader.length();
  const { end } = reader;
  reader.end = reader.at + size;
  const message = fields(reader, type);
  reader.end = end;
  return message;
}

function list(reader, type, wireType, values) {
  if (wireType !== 2 || !NUMBERS.has(type)) {
    values.push(value(reader, type));
    return;
  }
  const size = reader.length();
  const end = reader.at + size;
  while (reader.at < end) values.push(reader[type]());
}

function fields(reader, table) {
  const message = defaults(table);
  while (reader.more()) {
    const tag = reader.tag();
    const [name, type, many] = table[tag >>> 3] ?? [];
    const wireType = tag & 7;
    const packed = many === '*' && wireType === 2;
    if (name === undefined || (wireType !== typeOf(type) && !packed)) reader.skip(wireType);
    else if (many === '*') list(reader, type, wireType, message[name]);
    else message[name] = value(reader, type);
  }
  return message;
}

export function decode(table, bytes, from = 0) {
  return fields(new Reader().begin(bytes, from), table);
}

class Writer {
  bytes = [];

  uint(number) {
    let left = number;
    while (left > 127) {
      this.bytes.push((left % 128) | 128);
      left = Math.floor(left / 128);
    }
    this.bytes.push(left);
  }

  bool(flag) {
    this.uint(flag ? 1 : 0);
  }

  double(number) {
    const view = new DataView(new ArrayBuffer(8));
    view.setFloat64(0, number, true);
    for (let i = 0; i < 8; i += 1) this.bytes.push(view.getUint8(i));
  }

  block(bytes) {
    this.uint(bytes.length);
    for (const byte of bytes) this.bytes.push(byte);
  }

  string(text) {
    this.block(new TextEncoder().encode(text));
  }
}

function write(writer, number, type, one) {
  writer.uint((number << 3) | typeOf(type));
  if (type === 'bytes') writer.block(one);
  else if (typeof type === 'string') writer[type](one);
  else writer.block(encode(type, one));
}

// A field that the message has is written, also when it is 0, because a oneof tells by that which
// one is meant.
export function encode(table, message) {
  const writer = new Writer();
  for (const [number, [name, type, many]] of Object.entries(table)) {
    if (message[name] === undefined) continue;
    const all = many === '*' ? message[name] : [message[name]];
    for (const one of all) write(writer, Number(number), type, one);
  }
  return Uint8Array.from(writer.bytes);
}
