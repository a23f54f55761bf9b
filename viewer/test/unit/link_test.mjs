import assert from 'node:assert/strict';
import { test } from 'node:test';
import { ClockMapping } from '../../src/link/clock.js';
import { Connection } from '../../src/link/connection.js';
import { Latest } from '../../src/link/latest.js';
import { Requests } from '../../src/link/requests.js';
import { PIECE_BYTES, sendModel } from '../../src/link/upload.js';
import { ControlReply } from '../../src/wire/schema.js';
import { decode } from '../../src/wire/message.js';
import * as reference from '../support/messages.mjs';

test("the clock's fastest answer counts", () => {
  const clock = new ClockMapping();
  assert.equal(clock.known, false);
  clock.add(100, 140, 5120 + 15); // 15 ms off: the way back was slower
  clock.add(200, 202, 5201);
  clock.add(300, 390, 5300);
  assert.equal(clock.roundTrip_ms, 2);
  assert.equal(clock.toPage_ms(6000), 1000);
  clock.add(10, 5, 0); // time cannot run back
  assert.equal(clock.roundTrip_ms, 2);
  clock.clear();
  assert.equal(clock.known, false);
});

test('an old fast answer is forgotten, because clocks drift apart', () => {
  const clock = new ClockMapping();
  clock.add(0, 1, 1000.5);
  for (let i = 1; i <= 16; i += 1) clock.add(1000 * i, 1000 * i + 4, 1000 * i + 2 + 1000.8);
  assert.ok(Math.abs(clock.offset_ms - 1000.8) < 1e-9);
});

test("a slider's newest value replaces those that wait", async () => {
  const sent = [];
  let go;
  const latest = new Latest((value) => {
    sent.push(value);
    return new Promise((done) => {
      go = done;
    });
  });
  latest.put(1);
  latest.put(2);
  const last = latest.put(3);
  assert.deepEqual(sent, [1]);
  assert.ok(latest.busy);
  go();
  await new Promise(setImmediate);
  assert.deepEqual(sent, [1, 3]);
  go();
  await last;
});

test('requests are matched with their answers by number', async () => {
  const sent = [];
  const requests = new Requests((bytes) => sent.push(bytes));
  const first = requests.ask({ status: {} });
  const second = requests.ask({ list_models: {} });
  assert.equal(new DataView(sent[1].buffer).getUint32(0, true), 2);
  requests.reply(
    2,
    reference.encode('ControlReply', { ok: true, model: [{ name: 'a.style', kind: 'style' }] }),
    0,
  );
  const [model] = (await second).model;
  assert.deepEqual([model.name, model.kind], ['a.style', 'style']);
  requests.refused(1, 'it does not answer');
  assert.deepEqual([(await first).ok, (await first).error], [false, 'it does not answer']);
  requests.reply(99, new Uint8Array(), 0); // nobody asked
});

test('without a connection, or when it breaks, a request is answered with a sentence', async () => {
  const closed = await new Requests(() => false).ask({ status: {} });
  assert.match(closed.error, /no connection/);
  const requests = new Requests(() => true);
  const waiting = requests.ask({ status: {} });
  requests.abandon();
  assert.match((await waiting).error, /broke/);
});

test('a model goes in pieces of 32 KiB with its SHA-256, and stops at a refusal', async () => {
  const bytes = Uint8Array.from({ length: 2.5 * PIECE_BYTES }, (_, i) => i);
  const parts = [];
  const shares = [];
  const answer = { ok: true, sequence: 5 };
  const ask = async ({ model_part }) => {
    parts.push(model_part);
    return answer;
  };
  assert.equal(
    await sendModel(ask, 'walker', 'm.style', bytes, (share) => shares.push(share)),
    answer,
  );
  assert.deepEqual(
    parts.map(({ offset }) => offset),
    [0, PIECE_BYTES, 2 * PIECE_BYTES],
  );
  assert.equal(parts[2].bytes.length, PIECE_BYTES / 2);
  assert.match(parts[0].sha256, /^[0-9a-f]{64}$/);
  assert.equal(shares.at(-1), 1);
  const refused = await sendModel(
    async () => ({ ok: false, error: 'no' }),
    'walker',
    'm',
    bytes,
    () => {},
  );
  assert.equal(refused.error, 'no');
  assert.equal((await sendModel(ask, 'walker', 'm', new Uint8Array(), () => {})).ok, false);
});

// Puts these in the place of the browser's own until the test ends.
function pretend(browser, context) {
  const kept = Object.keys(browser).map((name) => [name, globalThis[name]]);
  Object.assign(globalThis, browser);
  context.after(() => Object.assign(globalThis, Object.fromEntries(kept)));
}

test('a connection that closes is said at once, also when the bridge hangs', async (context) => {
  const sockets = [];
  class Socket {
    constructor() {
      sockets.push(this);
    }

    close() {}
  }
  const asked = [];
  const hang = (_, { signal }) => {
    asked.push(signal);
    return new Promise(() => {});
  };
  const browser = { WebSocket: Socket, location: { protocol: 'http:', host: 'a' }, fetch: hang };
  pretend(browser, context);
  const states = [];
  const connection = new Connection('x', { state: (name) => states.push(name) });
  sockets[0].onclose();
  assert.deepEqual(states, ['connecting', 'closed']);
  assert.ok(asked[0] instanceof AbortSignal); // it ends by itself
  connection.close();
});

test('an open socket that carries nothing any more counts as closed', async (context) => {
  context.mock.timers.enable({ apis: ['setInterval', 'setTimeout'] });
  const sockets = [];
  class Socket {
    static OPEN = 1;
    readyState = Socket.OPEN;
    closed = false;
    constructor() {
      sockets.push(this);
    }
    send() {}
    close() {
      this.closed = true;
    }
  }
  const fetch = async () => ({ status: 200 });
  const browser = { WebSocket: Socket, location: { protocol: 'http:', host: 'a' }, fetch };
  pretend(browser, context);
  const said = [];
  new Connection('', { state: (name) => said.push(name), open() {}, binary() {}, text() {} });
  sockets[0].onopen();
  for (let second = 0; second < 10; ++second) {
    context.mock.timers.tick(1000);
    sockets[0].onmessage({ data: '{"type":"clock"}' });
  }
  assert.deepEqual(said, ['connecting']);
  context.mock.timers.tick(3000);
  assert.equal(sockets[0].closed, false); // one answer may be late
  context.mock.timers.tick(1000);
  assert.equal(sockets[0].closed, true);
  assert.deepEqual(said, ['connecting', 'closed']);
  await new Promise(setImmediate);
  context.mock.timers.tick(1000);
  assert.equal(sockets.length, 2);
});

test('a reply of the daemon reads as it was written', () => {
  const bytes = reference.encode('ControlReply', {
    ok: true,
    stream: 'walker',
    sequence: 1234,
    take: { number: 3, name: 'x' },
  });
  const reply = decode(ControlReply, bytes);
  assert.deepEqual([reply.ok, reply.sequence, reply.take.number], [true, 1234, 3]);
});
