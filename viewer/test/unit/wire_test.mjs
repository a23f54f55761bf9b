// The page's own reader beside protobufjs, which reads the .proto files.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Reader } from '../../src/wire/reader.js';
import { Pose, readPose } from '../../src/wire/pose.js';
import * as schema from '../../src/wire/schema.js';
import { decode, encode } from '../../src/wire/message.js';
import * as reference from '../support/messages.mjs';
import { random } from '../support/random.mjs';

function randomFrame(next) {
  const joints = 1 + Math.floor(60 * next());
  const floats = (count) => Array.from({ length: count }, () => Math.fround(2 * next() - 1));
  return {
    stream: 'walker',
    sequence: Math.floor(next() * 2 ** 40),
    arrival_ns: String(Math.floor(next() * 2 ** 52)),
    published_ns: String(Math.floor(next() * 2 ** 52)),
    clock_offset_ns: String(-Math.floor(next() * 2 ** 40)),
    skeleton_id: Math.floor(next() * 2 ** 32),
    root_position_m: floats(3),
    rotation_xyzw: floats(4 * joints),
    validity: Uint8Array.from({ length: joints }, () => Math.round(next())),
    angle_rad: floats(3 * joints),
    quality: Math.floor(4 * next()),
    source: Math.floor(4 * next()),
    label: ['', 'g', 'two'][Math.floor(3 * next())],
    label_probability: Math.fround(next()),
    lag_frames: Math.floor(5 * next()),
    lag_ms: Math.fround(50 * next()),
    stage_us: floats(3),
    timecode: '01:02:03:04',
  };
}

test('a frame reads as protobufjs wrote it, for many random frames', () => {
  const next = random(1);
  const pose = new Pose();
  for (let i = 0; i < 300; i += 1) {
    const frame = randomFrame(next);
    readPose(reference.encode('Frame', frame), 0, pose);
    const joints = frame.validity.length;
    assert.equal(pose.sequence, frame.sequence);
    assert.equal(pose.arrival_ms, Number(frame.arrival_ns) / 1e6);
    assert.equal(pose.published_ms, Number(frame.published_ns) / 1e6);
    assert.equal(pose.skeletonId, frame.skeleton_id);
    assert.deepEqual([...pose.root_m], frame.root_position_m);
    assert.equal(pose.joints, joints);
    assert.deepEqual([...pose.rotation.subarray(0, 4 * joints)], frame.rotation_xyzw);
    assert.deepEqual([...pose.validity.subarray(0, pose.validJoints)], [...frame.validity]);
    assert.deepEqual(
      [pose.quality, pose.source, pose.label],
      [frame.quality, frame.source, frame.label],
    );
    assert.deepEqual(
      [pose.labelProbability, pose.lagFrames, pose.lag_ms],
      [frame.label_probability, frame.lag_frames, frame.lag_ms],
    );
    assert.deepEqual([...pose.stage_us.subarray(0, pose.stages)], frame.stage_us);
    assert.equal(pose.timecode, frame.timecode);
  }
});

test('what a frame leaves out does not stay from the one before', () => {
  const pose = new Pose();
  readPose(reference.encode('Frame', randomFrame(random(2))), 0, pose);
  readPose(reference.encode('Frame', { stream: 'a', sequence: 7 }), 0, pose);
  assert.deepEqual([pose.sequence, pose.joints, pose.validJoints, pose.stages], [7, 0, 0, 0]);
  assert.deepEqual([pose.label, pose.quality, pose.timecode], ['', 0, '']);
});

test('a damaged or cut frame is a RangeError or another frame, never a hang', () => {
  const next = random(3);
  const pose = new Pose();
  let refused = 0;
  for (let i = 0; i < 3000; i += 1) {
    const bytes = Uint8Array.from(reference.encode('Frame', randomFrame(next)));
    const at = Math.floor(next() * bytes.length);
    bytes[at] ^= 1 << Math.floor(8 * next());
    const cut = next() < 0.5 ? bytes : bytes.subarray(0, at);
    try {
      readPose(cut, 0, pose);
    } catch (error) {
      assert.ok(error instanceof RangeError, String(error));
      refused += 1;
    }
  }
  assert.ok(refused > 300, `${refused} of 3000`);
});

test('negative 64-bit numbers are exact', () => {
  for (const number of [-1, -4200000, -(2 ** 52), 0, 1, 2 ** 52]) {
    const bytes = reference.encode('Frame', { arrival_ns: String(number) });
    const reader = new Reader().begin(bytes);
    if (number === 0) continue; // proto3 leaves it out
    reader.tag();
    assert.equal(reader.int(), number);
  }
});

test('the tables of schema.js agree with the .proto files', () => {
  const kinds = {
    uint: ['uint32', 'uint64', 'Event.Kind', 'Quality', 'Source'],
    int: ['int64', 'int32'],
    sint: ['sint32'],
    bool: ['bool'],
    float: ['float'],
    double: ['double'],
    fixed32: ['fixed32'],
    string: ['string'],
    bytes: ['bytes'],
  };
  let compared = 0;
  const compare = (table, type) => {
    for (const [number, [name, kind, many]] of Object.entries(table)) {
      const field = type.fieldsById[number];
      assert.equal(field?.name, name, `${type.name}.${name}`);
      compared += 1;
      if (field.map) {
        assert.equal(kind[1][1], field.keyType);
        assert.equal(kind[2][1], field.type);
        continue;
      }
      assert.equal(many === '*', field.repeated, `${type.name}.${name}`);
      field.resolve();
      if (typeof kind === 'object') compare(kind, field.resolvedType);
      else
        assert.ok(
          kinds[kind].includes(field.resolvedType ? 'Event.Kind' : field.type),
          `${type.name}.${name}`,
        );
    }
  };
  for (const name of ['Skeleton', 'Event', 'Stats', 'ControlRequest', 'ControlReply']) {
    compare(schema[name], reference.type(name));
  }
  assert.ok(compared > 80, String(compared));
  const kindNames = reference.type('Event').lookupEnum('Kind').valuesById;
  schema.EVENT_KINDS.forEach((kind, i) => {
    if (i > 0) assert.equal(`KIND_${kind.toUpperCase().replace(/ /g, '_')}`, kindNames[i]);
  });
});

test('statistics read as protobufjs wrote them', () => {
  const stats = {
    time_ns: '123456789012',
    cpu_percent: 2.5,
    rss_bytes: 31000000,
    recorder_file: 'a.plog',
    take: { number: 2, name: 'räume', start_ns: '5' },
    stream: [
      {
        stream: 'walker',
        state: 'live',
        rate_hz: 30,
        clock_offset_ns: '-77',
        style_gate: 0,
        alpha: 0.5,
        publish: { p50_us: 100, p99_us: 200, max_us: 300 },
        stage: [
          {
            name: 'style',
            word: ['a', 'b'],
            parameter: [{ name: 'alpha', value: 0.5, target: 1 }],
          },
        ],
      },
    ],
  };
  const read = decode(schema.Stats, reference.encode('Stats', stats));
  assert.equal(read.time_ns, 123456789012);
  assert.deepEqual([read.take.number, read.take.name], [2, 'räume']);
  const [stream] = read.stream;
  assert.deepEqual(
    [stream.clock_offset_ns, stream.style_gate, stream.style_estimate],
    [-77, 0, undefined],
  );
  assert.equal(stream.publish.max_us, 300);
  assert.deepEqual(stream.stage[0].word, ['a', 'b']);
  assert.deepEqual(stream.stage[0].parameter[0], {
    name: 'alpha',
    value: 0.5,
    target: 1,
    text: '',
  });
});

test('requests are what protobufjs reads back', () => {
  const check = (request) => {
    const read = reference.decode('ControlRequest', encode(schema.ControlRequest, request));
    assert.deepEqual(Object.keys(read), Object.keys(request));
    return read;
  };
  const set = check({
    set_parameter: { stream: 'walker', name: 'style.alpha', number: 0 },
  }).set_parameter;
  assert.deepEqual([set.number, 'text' in set, 'flag' in set], [0, false, false]);
  const play = check({
    stage_command: {
      stream: 'hand',
      name: 'generate.play',
      word: ['g', '1'],
      number: [{ key: 'tempo', value: 1.5 }],
    },
  }).stage_command;
  assert.deepEqual(play.word, ['g', '1']);
  assert.equal(play.number.tempo, 1.5);
  const bytes = Uint8Array.from({ length: 40000 }, (_, i) => i);
  const part = check({
    model_part: { stream: 'a', sha256: 'ff', total: 5e6, offset: 3e6, bytes, name: 'm' },
  }).model_part;
  assert.deepEqual(
    [part.total, part.offset, part.bytes.length, part.bytes[300]],
    [5e6, 3e6, 40000, 44],
  );
  check({ list_models: {} });
  const { teach } = check({ teach: { stream: 'a', mark: { style: true, seconds: 20 } } });
  assert.deepEqual([teach.mark.style, teach.mark.seconds, 'train' in teach], [true, 20, false]);
  assert.ok('cancel' in check({ teach: { stream: 'a', cancel: {} } }).teach);
});
