// The real daemon and the real bridge on free ports, playing the demo's walker and hand.
import { spawn } from 'node:child_process';
import { existsSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { createServer } from 'node:net';
import { createInterface } from 'node:readline';

const DEMO = join(dirname(fileURLToPath(import.meta.url)), '../../../build/demo');
export const hasDemo = () => existsSync(join(DEMO, 'hand.gesture'));

const configOf = ({ publish, control, folder }) => `
[publish]
endpoint = "${publish}"
[control]
endpoint = "${control}"
models = "${DEMO}"
recordings = "${folder}"
[[stream]]
name = "walker"
driver = "file"
publish_raw = true
[stream.file]
path = "${DEMO}/new_walker.bvh"
loop = true
[stream.style]
model = "${DEMO}/walk-to-sneak.style"
[stream.feet]
[[stream]]
name = "hand"
driver = "file"
[stream.file]
path = "${DEMO}/new_performer.csv"
loop = true
[stream.generate]
model = "${DEMO}/hand.gesture"
`;

// Only the hands of a page's camera.
export const cameraConfig = ({ publish, control, device }) => `
[publish]
endpoint = "${publish}"
[control]
endpoint = "${control}"
[[source]]
name = "camera"
driver = "landmarks"
streams = "all"
stale_after_s = 2.0
[source.landmarks]
listen = "${device}"
[source.generate]
`;

// Only a glove, which EmulatedGlove is.
export const gloveConfig = ({ publish, control, folder }) => `
[publish]
endpoint = "${publish}"
[control]
endpoint = "${control}"
models = "${folder}"
[[stream]]
name = "glove"
driver = "cyberglove"
port = "${folder}/glove"
[stream.generate]
`;

// The endpoint of a port that is free now; a daemon that restarts needs the same again.
async function freeEndpoint() {
  const server = createServer();
  await new Promise((done) => {
    server.listen(0, '127.0.0.1', done);
  });
  const { port } = server.address();
  await new Promise((done) => {
    server.close(done);
  });
  return `tcp://127.0.0.1:${port}`;
}

// A program whose first line of output is JSON: {program, line}. Rejects when it ends before.
async function start(program, args) {
  const child = spawn(program, args, { stdio: ['ignore', 'pipe', 'pipe'] });
  let complaint = '';
  child.stderr.on('data', (text) => {
    complaint += text;
  });
  const line = await new Promise((done, fail) => {
    createInterface({ input: child.stdout }).once('line', done);
    child.once('exit', () => fail(new Error(`${program} ${args[0]}: ${complaint}`)));
  });
  return { child, line: JSON.parse(line) };
}

async function end(child) {
  if (child.exitCode !== null) return;
  child.kill('SIGINT');
  await new Promise((done) => {
    child.once('exit', done);
  });
}

// A glove of the daemon's gloveConfig whose hand is still: its angles by the names of hand45 [deg],
// all others 0.
export class EmulatedGlove {
  constructor({ program, folder }) {
    Object.assign(this, { program, folder });
  }

  async hold(angles) {
    await this.stop();
    const fingers = ['thumb', 'index', 'middle', 'ring', 'little'];
    const axes = ['x', 'y', 'z'];
    const names = fingers.flatMap((f) => [1, 2, 3].flatMap((j) => axes.map((a) => `${f}${j}_${a}`)));
    const row = names.map((name) => ((angles[name] ?? 0) * Math.PI) / 180);
    const lines = [['time_s', ...names.map((name) => `${name}_rad`)], [0, ...row], [1, ...row]];
    const clip = join(this.folder, 'held.csv');
    writeFileSync(clip, lines.map((line) => `${line.join()}\n`).join(''));
    const link = join(this.folder, 'glove');
    const args = ['emulate', 'cyberglove', '--link', link, '--clip', clip];
    this.device = (await start(this.program, args)).child;
  }

  async stop() {
    if (this.device) await end(this.device);
  }
}

export class RealDaemon {
  constructor(program, config = configOf) {
    this.program = program;
    this.config = config;
    this.folder = mkdtempSync(join(tmpdir(), 'posed-page-'));
  }

  async start() {
    if (!this.publish) {
      this.publish = await freeEndpoint();
      this.control = await freeEndpoint();
      this.device = (await freeEndpoint()).slice('tcp://'.length);
      writeFileSync(join(this.folder, 'page.toml'), this.config(this));
    }
    const args = [
      'record',
      '--config',
      join(this.folder, 'page.toml'),
      '--out',
      join(this.folder, 'take.plog'),
      '--overwrite',
    ];
    this.daemon = (await start(this.program, args)).child;
  }

  // page: the folder; returns the page's address
  async view(page, ...more) {
    const args = [
      'view',
      '--json',
      '--port',
      '0',
      '--page',
      page,
      '--connect',
      this.publish,
      '--control',
      this.control,
      ...more,
    ];
    const { child, line } = await start(this.program, args);
    this.bridges = [...(this.bridges ?? []), child];
    return line.url;
  }

  // posed ctl ARGS: its output as JSON.
  async ctl(...args) {
    const child = spawn(this.program, ['ctl', '--connect', this.control, '--json', ...args]);
    let text = '';
    child.stdout.on('data', (piece) => {
      text += piece;
    });
    await new Promise((done) => {
      child.once('exit', done);
    });
    return JSON.parse(text);
  }

  async stopDaemon() {
    await end(this.daemon);
  }

  async stop() {
    for (const bridge of this.bridges ?? []) await end(bridge);
    await this.stopDaemon();
    rmSync(this.folder, { recursive: true });
  }
}
