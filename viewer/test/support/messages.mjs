// The messages of the protocol by protobufjs, from the .proto files themselves: what the page's own
// reader is tested against.
import protobuf from 'protobufjs';
import { fileURLToPath } from 'node:url';
import { dirname, join } from 'node:path';

export const PROTO = join(dirname(fileURLToPath(import.meta.url)), '../../../proto/wire');

const root = new protobuf.Root();
root.resolvePath = (_, file) => (file.startsWith('/') ? file : join(PROTO, file));
root.loadSync(['posed/v1/posed.proto', 'posed/v1/control.proto'], { keepCase: true });

export const type = (name) => root.lookupType(`posed.v1.${name}`);

export const encode = (name, message) => type(name).encode(type(name).fromObject(message)).finish();

export const decode = (name, bytes) =>
  type(name).toObject(type(name).decode(bytes), { longs: Number, bytes: Array, arrays: true });
