// Writes one skinned mesh and its joints as binary glTF 2.0.

const MAGIC = 0x46546c67; // "glTF"
const JSON_CHUNK = 0x4e4f534a;
const BIN_CHUNK = 0x004e4942;
const FLOAT = 5126;
const UINT16 = 5123;
const UINT8 = 5121;

class Buffer {
  bytes = [];
  views = [];
  accessors = [];

  // array: a typed array; returns the number of its accessor
  add(array, componentType, type, count, more = {}) {
    const data = new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
    this.views.push({ buffer: 0, byteOffset: this.bytes.length, byteLength: data.length });
    for (const byte of data) this.bytes.push(byte);
    while (this.bytes.length % 4 !== 0) this.bytes.push(0);
    this.accessors.push({ bufferView: this.views.length - 1, componentType, type, count, ...more });
    return this.accessors.length - 1;
  }
}

function bounds(position) {
  const min = [Infinity, Infinity, Infinity];
  const max = [-Infinity, -Infinity, -Infinity];
  position.forEach((value, i) => {
    min[i % 3] = Math.min(min[i % 3], value);
    max[i % 3] = Math.max(max[i % 3], value);
  });
  return { min, max };
}

function attributes(buffer, mesh) {
  const count = mesh.owner.length;
  const position = Float32Array.from(mesh.position);
  const joints = new Uint8Array(4 * count);
  const weights = new Float32Array(4 * count);
  mesh.owner.forEach((joint, i) => {
    joints[4 * i] = joint;
    weights[4 * i] = 1;
  });
  return {
    POSITION: buffer.add(position, FLOAT, 'VEC3', count, bounds(position)),
    NORMAL: buffer.add(Float32Array.from(mesh.normal), FLOAT, 'VEC3', count),
    JOINTS_0: buffer.add(joints, UINT8, 'VEC4', count),
    WEIGHTS_0: buffer.add(weights, FLOAT, 'VEC4', count),
  };
}

// A joint's inverse bind matrix: all joints stand unturned, so it only moves.
function inverseBind(joints) {
  return Float32Array.from(
    joints.flatMap(({ place: [x, y, z] }) => [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -x, -y, -z, 1]),
  );
}

function chunk(kind, data, filler) {
  const padded = new Uint8Array(Math.ceil(data.length / 4) * 4).fill(filler);
  padded.set(data);
  const head = new DataView(new ArrayBuffer(8));
  head.setUint32(0, padded.length, true);
  head.setUint32(4, kind, true);
  return [new Uint8Array(head.buffer), padded];
}

// joints: parents first, {bone, parent, offset, place}; extensions: of the whole file
export function glb({ joints, mesh, colour, extensions }) {
  const buffer = new Buffer();
  const primitive = {
    attributes: attributes(buffer, mesh),
    indices: buffer.add(Uint16Array.from(mesh.index), UINT16, 'SCALAR', mesh.index.length),
    material: 0,
  };
  const binds = buffer.add(inverseBind(joints), FLOAT, 'MAT4', joints.length);
  const nodes = joints.map(({ bone, offset }, i) => {
    const children = joints.flatMap(({ parent }, child) => (parent === i ? [child] : []));
    return { name: bone, translation: offset, ...(children.length > 0 ? { children } : {}) };
  });
  nodes.push({ name: 'body', mesh: 0, skin: 0 });
  const document = {
    asset: { version: '2.0', generator: 'posed mannequin' },
    extensionsUsed: Object.keys(extensions),
    extensions,
    scene: 0,
    scenes: [{ nodes: [0, joints.length] }],
    nodes,
    meshes: [{ name: 'body', primitives: [primitive] }],
    skins: [{ joints: joints.map((_, i) => i), inverseBindMatrices: binds, skeleton: 0 }],
    materials: [
      {
        name: 'skin',
        pbrMetallicRoughness: { baseColorFactor: colour, metallicFactor: 0, roughnessFactor: 0.65 },
      },
    ],
    buffers: [{ byteLength: buffer.bytes.length }],
    bufferViews: buffer.views,
    accessors: buffer.accessors,
  };
  return file(document, Uint8Array.from(buffer.bytes));
}

function file(document, bytes) {
  const chunks = [
    ...chunk(JSON_CHUNK, new TextEncoder().encode(JSON.stringify(document)), 0x20),
    ...chunk(BIN_CHUNK, bytes, 0),
  ];
  const total = 12 + chunks.reduce((sum, { length }) => sum + length, 0);
  const head = new DataView(new ArrayBuffer(12));
  head.setUint32(0, MAGIC, true);
  head.setUint32(4, 2, true);
  head.setUint32(8, total, true);
  const out = new Uint8Array(total);
  let at = 0;
  for (const part of [new Uint8Array(head.buffer), ...chunks]) {
    out.set(part, at);
    at += part.length;
  }
  return out;
}
