// "Use my camera" with a camera that shows a drawn hand: on a fake bridge, and (POSED=build/posed)
// with the real daemon, whose stream it becomes.
import assert from 'node:assert/strict';
import { existsSync, readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { FakeBridge, PAGE } from '../support/fake_bridge.mjs';
import { FakeDaemon } from '../support/fake_daemon.mjs';
import { RealDaemon, cameraConfig } from '../support/real_daemon.mjs';
import { opened as openedPage, PATIENCE } from '../support/browser.mjs';

const skip = existsSync(join(PAGE, 'camera'))
  ? false
  : 'SKIPPED without build/viewer/camera (`./run page` makes it)';
const options = { skip, timeout: 600000 };
const ENOUGH = 30; // pictures
const AXE = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');

export const tests = []; // what node's test() takes, for main.mjs
const test = (...one) => tests.push(one);

// The page, and the addresses that it asked for elsewhere.
function opened(context, url) {
  const own = new URL(url).origin;
  return openedPage(context, url, {
    before: (page) => {
      page.foreign = [];
      page.on('request', (request) => {
        const asked = request.url();
        if (!asked.startsWith(own) && !/^(blob|data):/.test(asked)) page.foreign.push(asked);
      });
    },
  });
}

const button = (page) => page.getByRole('button', { name: /my camera|the camera/ });
const panelOf = (page) =>
  page.evaluate(() => {
    const { camera } = globalThis.posedPage;
    return { running: camera.camera.running, frames: camera.frames, found: camera.found };
  });
const enough = (page, count) =>
  page.waitForFunction((n) => globalThis.posedPage.camera.frames >= n, count, PATIENCE);
// What happens to the camera's track, which the browser shows as a light.
async function keepTrack(page) {
  await page.waitForFunction(
    () => globalThis.posedPage.camera.video.srcObject !== null,
    undefined,
    PATIENCE,
  );
  await page.evaluate(() => {
    [globalThis.track] = globalThis.posedPage.camera.video.srcObject.getTracks();
  });
}
const trackState = (page) => page.evaluate(() => globalThis.track.readyState);

test('a hand before the camera is sent, until the page may not or is hidden', options, async (context) => {
  const bridge = await new FakeBridge(new FakeDaemon(), { camera: true }).start();
  context.after(() => bridge.stop());
  const page = await opened(context, bridge.url);
  await button(page).waitFor(PATIENCE);
  await page.getByText('The picture stays in this browser').waitFor(PATIENCE);
  assert.deepEqual(await panelOf(page), { running: false, frames: 0, found: 0 });
  await page.evaluate(() => {
    const { mediaDevices } = navigator;
    const asked = new Promise((answer) => {
      globalThis.answer = answer;
    });
    mediaDevices.getUserMedia = async (what) => {
      await asked;
      delete mediaDevices.getUserMedia;
      return mediaDevices.getUserMedia(what);
    };
  });
  const loads = [];
  page.on('request', (request) => {
    if (/finder\.js/.test(request.url())) loads.push(request);
  });
  const loading = page.waitForRequest(/finder\.js/, PATIENCE); // before the user is asked
  await page.locator('.camera').hover();
  await loading;
  assert.equal((await panelOf(page)).running, false);
  await button(page).click();
  await page.evaluate(() => globalThis.answer());
  await enough(page, ENOUGH);
  await keepTrack(page);
  const { frames, found } = await panelOf(page);
  assert.ok(found >= 0.95 * frames, `${found} of ${frames}`);
  const right = bridge.landmarks.filter(({ hands }) => hands[0]?.side === 'right').length;
  assert.ok(right >= 0.8 * bridge.landmarks.length, `right ${right} of ${bridge.landmarks.length}`);
  const [first] = bridge.landmarks;
  const ages = await page.evaluate(() => globalThis.posedPage.camera.ages_ms.map(Math.round));
  ages.sort((a, b) => a - b);
  assert.equal(first.version, 1);
  assert.ok(first.hands.every(({ points }) => points.length === 63));
  const rate =
    (1e9 * (bridge.landmarks.length - 1)) / (bridge.landmarks.at(-1).time_ns - first.time_ns);
  context.diagnostic(`found ${found} of ${frames}, right ${right}, ${rate.toFixed(1)} a second`);
  context.diagnostic(`age p50 ${ages[ages.length >> 1]} p95 ${ages[(ages.length * 0.95) | 0]} ms`);
  await page.evaluate(AXE);
  const faults = await page.evaluate(async () => (await globalThis.axe.run('.camera')).violations);
  assert.deepEqual(faults, []);
  await page.locator('.camera').screenshot({ path: join(PAGE, '../camera.png') });
  await page.evaluate(() => {
    Object.defineProperty(document, 'hidden', { value: true, configurable: true });
    document.dispatchEvent(new Event('visibilitychange'));
    delete document.hidden;
  });
  assert.equal(await trackState(page), 'ended');
  await page.getByText('stopped, because the page was hidden').waitFor(PATIENCE);
  const sent = bridge.landmarks.length;
  // While the browser asks, too.
  const asked = await page.evaluate(async () => {
    const { camera } = globalThis.posedPage;
    camera.toggle();
    camera.stop('enough');
    await new Promise((done) => {
      setTimeout(done, 2000);
    });
    return { running: camera.camera.running, words: camera.words.textContent };
  });
  assert.deepEqual(asked, { running: false, words: 'enough' });
  assert.equal(bridge.landmarks.length, sent);
  // What finds hands fails while the browser asks, which answers later.
  const failed = await page.evaluate(async () => {
    const { camera } = globalThis.posedPage;
    const { Worker } = globalThis;
    globalThis.Worker = class extends EventTarget {
      constructor() {
        super();
        setTimeout(() => this.onerror());
      }
      terminate() {}
    };
    camera.camera.forget();
    camera.toggle();
    await new Promise((done) => {
      setTimeout(done, 2000);
    });
    globalThis.Worker = Worker;
    return { running: camera.camera.running, words: camera.words.textContent };
  });
  assert.deepEqual(failed, { running: false, words: 'what finds hands cannot be loaded' });
  // Another camera is chosen while the browser asks, and the first one is refused then.
  await page.evaluate(async () => {
    const { mediaDevices } = navigator;
    let refuse;
    mediaDevices.getUserMedia = () =>
      new Promise((_, reject) => {
        refuse = reject;
        delete mediaDevices.getUserMedia;
      });
    const { camera } = globalThis.posedPage;
    camera.toggle();
    camera.device.onchange();
    refuse(new Error('the first one'));
  });
  await keepTrack(page);
  await button(page).click();
  assert.equal(await trackState(page), 'ended');
  await button(page).click();
  await keepTrack(page);
  bridge.say({ type: 'control', may_control: false, read_only_reason: 'only looking' });
  await page.waitForFunction(() => globalThis.track.readyState === 'ended', undefined, PATIENCE);
  assert.ok(await button(page).isDisabled());
  assert.equal(loads.length, 3, 'what finds hands stays until the page is hidden');
  assert.deepEqual(page.foreign, []);
  assert.deepEqual(page.errors, []);
});

test('without its files the page offers no camera', options, async (context) => {
  const bridge = await new FakeBridge(new FakeDaemon()).start();
  context.after(() => bridge.stop());
  const page = await opened(context, bridge.url);
  await page.locator('.link[data-tone="good"]').waitFor(PATIENCE);
  assert.ok(await page.locator('.camera').isHidden());
});

test(
  "the camera's hand becomes a stream of the daemon",
  { ...options, skip: skip || (process.env.POSED ? false : 'SKIPPED without POSED') },
  async (context) => {
    const daemon = new RealDaemon(process.env.POSED, cameraConfig);
    await daemon.start();
    context.after(() => daemon.stop());
    const page = await opened(context, await daemon.view(PAGE));
    await button(page).click();
    await enough(page, 1);
    const began_ms = performance.now();
    await page.waitForFunction(
      () => globalThis.posedPage.store.streams.get('camera-right')?.drawable,
      undefined,
      PATIENCE,
    );
    context.diagnostic(`first hand to stream ${Math.round(performance.now() - began_ms)} ms`);
    await enough(page, ENOUGH);
    await page.screenshot({ path: join(PAGE, '../camera_page.png') });
    await button(page).click(); // the hand leaves
    await page.waitForFunction(
      () => !globalThis.posedPage.store.streams.has('camera-right'),
      undefined,
      PATIENCE,
    );
    assert.deepEqual(page.foreign, []);
    assert.deepEqual(page.errors, []);
  },
);
