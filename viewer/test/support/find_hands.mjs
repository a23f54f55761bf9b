// What the page's own worker finds in films of drawn_hands.cpp: node find_hands.mjs BASE...
// BASE.rgba becomes BASE.hands, a message of landmarks a picture. Needs build/viewer (./run page).
import { createServer } from 'node:http';
import { openSync, readFileSync, readSync, statSync, writeFileSync } from 'node:fs';
import { extname, join } from 'node:path';
import { PAGE } from './fake_bridge.mjs';
import { launch } from './browser.mjs';
import { landmarksMessage } from '../../src/camera/hands_of.js';

const [WIDTH, HEIGHT] = [320, 240];
const PICTURE = WIDTH * HEIGHT * 4; // bytes
const TYPES = { '.js': 'text/javascript', '.wasm': 'application/wasm' };
const EMPTY = '<!doctype html><title>find hands</title>';

// The empty page, the folder of the camera, and the pictures of a film.
function serve(film) {
  const answer = (path) => {
    if (path === '/') return ['text/html', EMPTY];
    const [, number] = /^\/picture\/(\d+)$/.exec(path) ?? [];
    if (!number) return [TYPES[extname(path)], readFileSync(join(PAGE, path))];
    const bytes = Buffer.alloc(PICTURE);
    readSync(film, bytes, 0, PICTURE, Number(number) * PICTURE);
    return [undefined, bytes];
  };
  return createServer((request, response) => {
    try {
      const [type, body] = answer(request.url);
      response.writeHead(200, { 'content-type': type ?? 'application/octet-stream' }).end(body);
    } catch {
      response.writeHead(404).end();
    }
  }).listen(0, '127.0.0.1');
}

// In the page.
async function find({ count, width, height }) {
  const worker = new Worker('/camera/finder.js');
  const answer = () =>
    new Promise((done) => {
      worker.onmessage = ({ data }) => done(data);
    });
  await answer();
  const all = [];
  for (let i = 0; i < count; i += 1) {
    const bytes = await (await fetch(`/picture/${i}`)).arrayBuffer();
    const image = new ImageData(new Uint8ClampedArray(bytes), width, height);
    const picture = await createImageBitmap(image);
    const found = answer();
    worker.postMessage({ picture, time_ms: 100 * i }, [picture]);
    const { time_ms, hands } = await found;
    all.push({ time_ms, hands });
  }
  return all;
}

const browser = await launch();
for (const base of process.argv.slice(2)) {
  const server = serve(openSync(`${base}.rgba`));
  const page = await browser.newPage();
  await page.goto(`http://127.0.0.1:${server.address().port}/`);
  const count = statSync(`${base}.rgba`).size / PICTURE;
  const all = await page.evaluate(find, { count, width: WIDTH, height: HEIGHT });
  const messages = all.map(({ hands, time_ms }) => landmarksMessage(hands, { time_ms }));
  const lines = messages.map((message) => `${JSON.stringify(message)}\n`);
  writeFileSync(`${base}.hands`, lines.join(''));
  const found = all.filter(({ hands }) => hands.length > 0).length;
  console.log(`${base}: found in ${found} of ${count}`);
  await page.close();
  server.close();
}
await browser.close();
