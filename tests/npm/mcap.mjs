// Reads an MCAP as a viewer does: by its indexes, and with the schema that is in the file.
import assert from 'node:assert/strict';
import { open } from 'node:fs/promises';
import { join } from 'node:path';
import { McapIndexedReader, McapStreamReader } from '@mcap/core';
import protobuf from 'protobufjs';
import descriptor from 'protobufjs/ext/descriptor.js';
import { Quaternion } from 'three';

import { angleBetween, readBvh, turnOf } from './bvh.mjs';
import { posed, record } from './files.mjs';

// Parts of a file, as @mcap/core asks for them.
class Readable {
  constructor(file) {
    this.file = file;
  }

  async size() {
    return BigInt((await this.file.stat()).size);
  }

  async read(offset, length) {
    const bytes = new Uint8Array(Number(length));
    const { bytesRead } = await this.file.read(bytes, 0, bytes.length, Number(offset));
    assert.equal(bytesRead, bytes.length);
    return bytes;
  }
}

function typeOf(schema) {
  assert.equal(schema.encoding, 'protobuf');
  const set = descriptor.FileDescriptorSet.decode(schema.data);
  return protobuf.Root.fromDescriptor(set).lookupType(schema.name);
}

// Messages by topic, decoded by the schemas that are in the file.
async function readMessages(file) {
  const reader = await McapIndexedReader.Initialize({ readable: new Readable(file) });
  const topics = new Map();
  let last = 0n;
  for await (const message of reader.readMessages()) {
    assert.ok(message.logTime >= last);
    last = message.logTime;
    const channel = reader.channelsById.get(message.channelId);
    assert.equal(channel.messageEncoding, 'protobuf');
    const type = typeOf(reader.schemasById.get(channel.schemaId));
    const topic = topics.get(channel.topic) ?? [];
    topic.push({ time: message.logTime, sequence: message.sequence, value: type.decode(message.data) });
    topics.set(channel.topic, topic);
  }
  const counted = reader.statistics.messageCount;
  assert.equal(Number(counted), [...topics.values()].reduce((sum, topic) => sum + topic.length, 0));
  return topics;
}

// The reader that goes through the whole file checks every checksum.
async function checkStream(file) {
  const reader = new McapStreamReader({ validateCrcs: true });
  reader.append(await file.readFile());
  let chunks = 0;
  for (let part = reader.nextRecord(); part; part = reader.nextRecord()) {
    if (part.type === 'Statistics') chunks = part.chunkCount;
  }
  assert.ok(reader.done());
  assert.ok(chunks > 0);
}

// Returns the skeleton of the clip.
export async function checkMcap(program, folder, clip) {
  const log = await record(program, folder, clip);
  const path = join(folder, 'take.mcap');
  const before = BigInt(Date.now()) * 1000000n;
  const summary = JSON.parse(posed(program, 'convert', log, '--out', path, '--json'));
  assert.deepEqual(summary.warnings, []);
  const file = await open(path);
  const topics = await readMessages(file);
  await checkStream(file);
  await file.close();
  assert.deepEqual([...topics.keys()].sort(), ['event/plain', 'event/walker', 'pose/plain', 'pose/walker',
    'skeleton/plain', 'skeleton/walker', 'tf/plain', 'tf/walker']);
  const { joints, frames } = readBvh(clip);
  let worst = 0;
  for (const name of ['plain', 'walker']) {
    const [skeleton] = topics.get(`skeleton/${name}`);
    assert.deepEqual(skeleton.value.joint_name, joints.map((joint) => joint.name));
    const [started] = topics.get(`event/${name}`);
    assert.equal(started.value.kind, 1);  // KIND_STARTED
    assert.equal(started.value.text, 'the first data came');
    const poses = topics.get(`pose/${name}`);
    assert.equal(poses.length, frames.length);
    poses.forEach(({ time, sequence, value }, i) => {
      assert.equal(sequence, i + 1);
      assert.equal(value.skeleton_id, skeleton.value.id);
      assert.ok(before - time < 60_000_000_000n && time <= before);  // recorded just now, in UTC
      joints.forEach((joint, j) => {
        const turned = new Quaternion().fromArray(value.rotation_xyzw, 4 * j);
        worst = Math.max(worst, angleBetween(turned, turnOf(joint, frames[i])));
      });
    });
  }
  assert.ok(worst < 1e-5, `${worst} rad`);
  console.log(`mcap: 2 streams of ${frames.length} frames, at most ${worst.toExponential(1)} rad off`);
  return topics.get('skeleton/walker')[0].value;
}
