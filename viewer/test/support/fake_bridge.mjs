// A bridge for the tests of the page alone, without posed: it serves the page's folder and speaks
// the protocol of `posed view`. By hand: node test/support/fake_bridge.mjs [PORT]
import { createServer } from 'node:http';
import { readFileSync, readdirSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { WebSocketServer } from 'ws';
import { FakeDaemon } from './fake_daemon.mjs';
import { decode, encode } from './messages.mjs';

export const PAGE = join(dirname(fileURLToPath(import.meta.url)), '../../../build/viewer');

const TYPES = {
  html: 'text/html',
  js: 'text/javascript',
  css: 'text/css',
  svg: 'image/svg+xml',
  vrm: 'model/gltf-binary',
  wasm: 'application/wasm',
};
const AVATARS = ['mannequin.vrm', 'mannequin-coarse.vrm'];
const FILES = ['index.html', 'page.js', 'page.css', 'icon.svg', ...AVATARS];
const POLICY =
  "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self' blob: data:";

function framed(topic, bytes) {
  const head = Buffer.from(topic, 'ascii');
  return Buffer.concat([Buffer.from([head.length]), head, bytes]);
}

class Tab {
  credits = 0;
  unsent = new Map(); // topic: bytes

  constructor(socket, bridge) {
    this.socket = socket;
    this.bridge = bridge;
    this.say({
      type: 'hello',
      version: 'fake',
      connect: 'tcp://127.0.0.1:5570',
      same_machine: bridge.same_machine,
      camera: bridge.camera,
      ...bridge.rights,
    });
    this.say({ type: 'daemon', alive: true, sentence: '' });
    for (const message of bridge.daemon.skeletons()) this.send(...message);
    this.send('stats', encode('Stats', bridge.daemon.stats()));
    socket.on('message', (data, binary) =>
      binary ? this.#request(data) : this.#text(JSON.parse(data)),
    );
  }

  say(object) {
    this.socket.send(JSON.stringify(object));
  }

  send(topic, bytes) {
    this.socket.send(framed(topic, bytes));
  }

  #text(message) {
    if (message.posed === 'landmarks') this.bridge.landmarks.push(message);
    if (message.type === 'ready') this.credits = 1;
    if (message.type === 'clock')
      this.say({ ...message, monotonic_ns: String(process.hrtime.bigint()) });
    this.flush();
  }

  flush() {
    if (this.credits === 0 || this.unsent.size === 0) return;
    this.credits = 0;
    for (const [topic, bytes] of this.unsent) this.send(topic, bytes);
    this.unsent.clear();
  }

  #request(data) {
    const number = data.readUInt32LE(0);
    const request = decode('ControlRequest', data.subarray(4));
    this.bridge.requests.push(request);
    this.send(`reply/${number}`, encode('ControlReply', this.bridge.daemon.answer(request)));
    this.bridge.publishStats();
  }
}

export class FakeBridge {
  requests = [];
  landmarks = []; // messages of the page's camera
  #tabs = new Set();
  #timers = [];
  silent = false;

  constructor(
    daemon,
    {
      token = 'secret',
      rights = { may_control: true, read_only_reason: '' },
      same_machine = true,
      folder = PAGE,
      camera = false,
    } = {},
  ) {
    Object.assign(this, { daemon, token, rights, same_machine, folder, camera });
  }

  async start(port = 0) {
    const names = this.camera
      ? [...FILES, ...readdirSync(join(this.folder, 'camera')).map((name) => `camera/${name}`)]
      : FILES;
    const files = new Map(names.map((name) => [`/${name}`, readFileSync(join(this.folder, name))]));
    this.http = createServer((request, response) => this.#serve(files, request, response));
    const sockets = new WebSocketServer({
      server: this.http,
      path: '/ws',
      verifyClient: ({ req }) => this.#knows(req),
    });
    sockets.on('connection', (socket) => this.#enter(socket));
    await new Promise((done) => {
      this.http.listen(port, '127.0.0.1', done);
    });
    this.port = this.http.address().port;
    this.#publish();
    return this;
  }

  get url() {
    return `http://127.0.0.1:${this.port}/?token=${this.token}`;
  }

  #knows({ url }) {
    return new URL(url, 'http://localhost').searchParams.get('token') === this.token;
  }

  #serve(files, request, response) {
    const { pathname } = new URL(request.url, 'http://localhost');
    const body = files.get(pathname === '/' ? '/index.html' : pathname);
    const status = !body ? 404 : pathname === '/' && !this.#knows(request) ? 403 : 200;
    const type = TYPES[pathname === '/' ? 'html' : pathname.split('.').pop()] ?? 'text/plain';
    const policy = this.camera
      ? POLICY.replace("script-src 'self'", "script-src 'self' 'wasm-unsafe-eval'")
      : POLICY;
    response.writeHead(status, { 'content-type': type, 'content-security-policy': policy });
    response.end(status === 200 ? body : 'refused: open the URL that posed view printed');
  }

  #enter(socket) {
    const tab = new Tab(socket, this);
    this.#tabs.add(tab);
    socket.on('close', () => this.#tabs.delete(tab));
  }

  publishStats() {
    const stats = encode('Stats', this.daemon.stats());
    for (const tab of this.#tabs) tab.send('stats', stats);
  }

  // A quick timer asks how many frames are due: node's own are too coarse for 120 Hz. Frames that
  // no page asks for are counted, but not made: to encode all of them took a quarter of a core.
  #publish() {
    this.#timers.push(
      setInterval(() => {
        const { daemon } = this; // a test may put another in its place
        const due = Math.ceil(daemon.time_s() * daemon.rate_hz);
        const asking = [...this.#tabs].filter(({ credits }) => credits > 0);
        if (daemon.frames >= due || asking.length === 0) return;
        const poses = daemon.poses(due - daemon.frames);
        for (const tab of asking) {
          for (const [topic, bytes] of poses) tab.unsent.set(topic, bytes);
          tab.flush();
        }
      }, 2),
    );
    this.#timers.push(setInterval(() => this.silent || this.publishStats(), 1000));
  }

  say(object) {
    for (const tab of this.#tabs) tab.say(object);
  }

  // From now on the daemon does not answer, so no statistics come either.
  silence() {
    this.silent = true;
    this.say({ type: 'daemon', alive: false, sentence: 'the daemon does not answer' });
  }

  async stop() {
    if (!this.http.listening) return;
    this.#timers.forEach(clearInterval);
    for (const { socket } of this.#tabs) socket.terminate();
    this.http.closeAllConnections();
    await new Promise((done) => {
      this.http.close(done);
    });
  }
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const bridge = await new FakeBridge(new FakeDaemon()).start(Number(process.argv[2] ?? 0));
  console.log(bridge.url);
}
