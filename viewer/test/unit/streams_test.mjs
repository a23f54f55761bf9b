import assert from 'node:assert/strict';
import { readFileSync, readdirSync } from 'node:fs';
import { test } from 'node:test';
import { Store } from '../../src/streams/store.js';
import { Jitter } from '../../src/streams/jitter.js';
import { History } from '../../src/instruments/history.js';
import { Series } from '../../src/instruments/series.js';
import { ClockMapping } from '../../src/link/clock.js';
import { waysOf } from '../../src/panel/ways.js';
import { namedStages, stageWords, stateOf } from '../../src/streams/words.js';
import { lanesOf } from '../../src/scene/lanes.js';
import { parseWeights } from '../../src/panel/style_controls.js';
import { bodySkeleton, walk } from '../support/figures.mjs';
import * as reference from '../support/messages.mjs';

function message(topic, bytes) {
  return Uint8Array.from([topic.length, ...new TextEncoder().encode(topic), ...bytes]);
}
const skeletonOf = (stream, id) =>
  message(
    `skeleton/${stream}`,
    reference.encode('Skeleton', bodySkeleton({ stream, id, stage: [] })),
  );
const poseOf = (stream, skeleton_id, sequence) =>
  message(
    `pose/${stream}`,
    reference.encode('Frame', {
      stream,
      skeleton_id,
      sequence,
      arrival_ns: String(sequence * 1e7),
      ...walk(0, 0),
    }),
  );
const statsOf = (...names) =>
  message(
    'stats',
    reference.encode('Stats', { stream: names.map((stream) => ({ stream, state: 'live' })) }),
  );

test('what was refused long ago is counted, and is no state of now', () => {
  const stats = (ok, refused, failures) => ({
    stream: [],
    source: [{ name: 'cam', driver: 'landmarks', outcome: [ok, refused], streams: 0 }],
    output: [{ name: 'o', kind: 'vmc', receivers: 1, frames: 9, sent: 9, dropped: 0, failures }],
  });
  const words = (now, before) => {
    const { inputs, outputs } = waysOf(now, 'tcp://x', before);
    return [inputs[0].word, outputs[1].word, outputs[1].counts.filter(Boolean).join('; ')];
  };
  const long = '9 messages to 1 receiver; 5 sendings refused so far';
  assert.deepEqual(words(stats(10, 50, 5)), ['not in use', 'sends', long]);
  assert.deepEqual(words(stats(10, 50, 5), stats(10, 50, 5)), ['not in use', 'sends', long]);
  assert.deepEqual(words(stats(90, 50, 5), stats(90, 20, 4)), [
    'messages refused',
    'refused',
    `${long}; does it listen there?`,
  ]);
});

test('a stream is drawn once its skeleton and a pose of that skeleton are here', () => {
  const store = new Store();
  const told = [];
  for (const type of ['skeleton', 'gone'])
    store.addEventListener(type, ({ detail }) => told.push(`${type} ${detail.name}`));
  store.receive(poseOf('walker', 7, 1));
  const stream = store.streams.get('walker');
  assert.equal(stream.place(), false);
  store.receive(skeletonOf('walker', 8));
  assert.equal(stream.place(), false); // the pose is of another skeleton
  store.receive(poseOf('walker', 8, 2));
  assert.equal(stream.place(), true);
  assert.equal(stream.place(), false); // nothing new
  store.receive(skeletonOf('walker', 8)); // the same again, as every second
  assert.deepEqual(told, ['skeleton walker']);
  assert.ok(Math.abs(stream.kinematics.position[1] - walk(0, 0).root_position_m[1]) < 1e-6);
});

test('streams come and go with the statistics; a raw twin goes with its stream', () => {
  const store = new Store();
  for (const name of ['a', 'a-raw', 'b']) store.receive(skeletonOf(name, 1));
  store.receive(statsOf('b', 'a'));
  assert.deepEqual(
    store.main().map(({ name }) => name),
    ['b', 'a'],
  );
  assert.equal(store.raw(store.streams.get('a')).name, 'a-raw');
  store.receive(statsOf('b'));
  assert.deepEqual([...store.streams.keys()], ['a', 'a-raw', 'b']); // they may be older than it
  store.receive(statsOf('b'));
  store.receive(poseOf('a', 1, 1)); // it is there, whatever they say
  store.receive(statsOf('b'));
  assert.deepEqual([...store.streams.keys()], ['a', 'b']);
  for (let i = 0; i < 3; i += 1) store.receive(statsOf('b'));
  assert.deepEqual([...store.streams.keys()], ['b']);
});

test('without word of the daemon no stream is called live, until the next statistics', () => {
  const store = new Store();
  store.receive(statsOf('a'));
  assert.equal(stateOf(store.streams.get('a').stats).word, 'live');
  store.silence();
  assert.equal(stateOf(store.main()[0].stats).word, 'unknown');
  store.receive(statsOf('a'));
  assert.equal(stateOf(store.main()[0].stats).word, 'live');
});

test('damaged messages are counted, and change nothing', () => {
  const store = new Store();
  store.receive(skeletonOf('a', 1));
  store.receive(poseOf('a', 1, 5));
  store.receive(poseOf('a', 1, 6).subarray(0, 40));
  store.receive(new Uint8Array([200, 1]));
  store.receive(new Uint8Array());
  assert.equal(store.damaged, 1);
  assert.equal(store.streams.get('a').pose.sequence, 5);
});

test('states in words, the worst first', () => {
  const live = {
    refusal: '',
    away: false,
    connections: 1,
    state: 'live',
    dropped: 0,
    shed: 0,
    kernel_dropped: 0,
    lossy: false,
  };
  assert.equal(stateOf(live).word, 'live');
  assert.equal(stateOf({ ...live, away: true }).word, 'lost');
  assert.equal(stateOf({ ...live, away: true, connections: 0 }).word, 'away');
  assert.equal(stateOf({ ...live, state: 'stale' }).tone, 'busy');
  assert.equal(stateOf({ ...live, refusal: 'no hips', away: true }).sentence, 'no hips');
  assert.equal(stateOf({ ...live, shed: 3 }).tone, 'good');
  assert.match(stateOf({ ...live, shed: 3 }).sentence, /3 frames .* none recently/);
  assert.equal(stateOf({ ...live, shed: 3, lossy: true }).word, 'losing');
  assert.equal(stateOf({ ...live, shed: 3, lossy: true }).tone, 'bad');
});

test('jitter of even frames is 0, also when the page sees only some', () => {
  const jitter = new Jitter();
  for (const sequence of [1, 2, 4, 5, 9, 10, 12]) jitter.add(sequence, 10 * sequence);
  assert.ok(jitter.ms < 1e-9);
  for (let i = 13; i < 400; i += 1) jitter.add(i, 10 * i + (i % 2 === 0 ? 2 : -2));
  assert.ok(Math.abs(jitter.ms - 4) < 0.5, String(jitter.ms));
});

test('a pause between even frames is no jitter', () => {
  const jitter = new Jitter();
  for (let i = 0; i < 200; i += 1) {
    jitter.add(i, (1000 * i) / 60 + (i < 100 ? 0 : 2000));
    if (i > 1) assert.ok(jitter.ms < 1, `${jitter.ms} ms at frame ${i}`);
  }
});

test('the history knows when another gesture began', () => {
  const history = new History();
  const clock = new ClockMapping();
  const labels = ['', 'g', 'g', '', 'c', 'c'];
  labels.forEach((label, i) => {
    const pose = { quality: 0, arrival_ms: 0, published_ms: 0, stages: 0, label };
    history.add({ ...pose, stage_us: [], labelProbability: 0.8 }, 0, 100 * i, clock);
  });
  assert.deepEqual(history.changes, [
    { at_s: 0.1, text: 'g' },
    { at_s: 0.3, text: '' },
    { at_s: 0.4, text: 'c' },
  ]);
});

test('a series keeps the newest, and gives those of a time window', () => {
  const series = new Series(8, 1);
  for (let i = 0; i < 20; i += 1) series.add(i, 10 * i);
  const [times, values] = series.since(17);
  assert.deepEqual(
    [[...times], [...values]],
    [
      [17, 18, 19],
      [170, 180, 190],
    ],
  );
  assert.ok(series.length <= 8);
  series.add(3, 1); // time ran back: another connection
  assert.equal(series.length, 1);
  assert.equal(new Series(8, 1).quantile(0, 0.5), NaN);
  for (let i = 0; i < 7; i += 1) series.add(4 + i, NaN); // only one has the quantity
  assert.equal(series.quantile(0, 0.95), 1);
});

test('lanes: raw beside styled, the bodies of one device together', () => {
  const stream = (name, source_name = '') => ({ name, stats: { source_name } });
  const lanes = lanesOf(
    [stream('a'), stream('b', 'hall'), stream('c', 'hall')],
    ({ name }) => name === 'a',
  );
  assert.deepEqual([lanes.get('a').raw, lanes.get('a').styled], [-1, 0]);
  assert.deepEqual([lanes.get('b').styled, lanes.get('c').styled], [1, 1]);
});

test('weights as text: shares by name, without a text the first style alone', () => {
  assert.deepEqual(parseWeights('old=0.4, young=0.6', ['young', 'old', 'tired']), [0.6, 0.4, 0]);
  assert.deepEqual(parseWeights('', ['young', 'old']), [1, 0]);
});

test('a step has the same name here as in the terminal', () => {
  const models = new URL('../../../models/', import.meta.url);
  const sources = readdirSync(models, { recursive: true }).filter((name) => name.endsWith('.cpp'));
  const named = sources.flatMap((name) =>
    [
      ...readFileSync(new URL(name, models), 'utf8').matchAll(
        /StageType type\{\s*\.name = "(\w+)",[^{}]*?\.words = "([^"]+)"/g,
      ),
    ].map(([, stage, words]) => [stage, words]),
  );
  assert.deepEqual(named.map(([stage]) => stage).sort(), [...namedStages].sort());
  for (const [stage, words] of named) assert.equal(stageWords(stage), words);
});
