// The page with the real bridge and the real daemon: POSED=path/to/posed node daemon_test.mjs
import assert from 'node:assert/strict';
import { readFileSync, statSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { PAGE } from '../support/fake_bridge.mjs';
import { EmulatedGlove, RealDaemon, gloveConfig, hasDemo } from '../support/real_daemon.mjs';
import { askedAgain, opened, PATIENCE } from '../support/browser.mjs';

const BUILD = join(dirname(fileURLToPath(import.meta.url)), '../../../build');
const LARGEST_PICTURE = 400_000;
const skip = hasDemo()
  ? false
  : 'SKIPPED without build/demo (`build/posed demo --prepare build/demo` makes it)';
const options = { skip, timeout: 900000 };

let daemon;
const tests = [];
const told = (...one) => tests.push(one);

// For main.mjs.
export function daemonTests() {
  before(async () => {
    if (skip) return;
    daemon = new RealDaemon(process.env.POSED);
    await daemon.start();
  });
  after(() => daemon?.stop());
  for (const one of tests) test(...one);
}

const drawn = (page) => page.locator('.name-tag:visible').first().waitFor(PATIENCE);
const acknowledged = (page, text) =>
  page.locator('.ack', { hasText: text }).first().waitFor(PATIENCE);
const statsOf = async (name) =>
  (await daemon.ctl('status')).status.stream.find(({ stream }) => stream === name);

// Waits until joints of the stream have moved by a centimetre.
async function moves(page, name) {
  const first = await page.waitForFunction(
    (stream) => {
      const one = globalThis.posedPage.store.streams.get(stream);
      return one?.drawable ? [...one.kinematics.position] : false;
    },
    name,
    PATIENCE,
  );
  await page.waitForFunction(
    ([stream, was]) =>
      globalThis.posedPage.store.streams
        .get(stream)
        .kinematics.position.some((value, i) => Math.abs(value - was[i]) > 0.01),
    [name, await first.jsonValue()],
    PATIENCE,
  );
}

told(
  "the demo's walker and hand move, and a picture of them is small",
  options,
  async (context) => {
    const size = { width: 1280, height: 800 };
    const page = await opened(context, `${await daemon.view(PAGE)}&fine`, size);
    await drawn(page);
    for (const name of ['walker', 'walker-raw', 'hand']) await moves(page, name);
    await page.waitForTimeout(1000); // the plots begin
    const picture = join(BUILD, 'page.png');
    // Without the instruments: their times are those of a processor that draws.
    const { y, height } = await page.locator('.stage').boundingBox();
    await page.screenshot({
      path: picture,
      clip: { x: 0, y: 0, width: size.width, height: y + height },
    });
    assert.ok(statSync(picture).size < LARGEST_PICTURE);
    assert.deepEqual(page.errors, []);
  },
);

told(
  'alpha, mask, gestures and takes reach the daemon, which is live again when it restarts',
  options,
  async (context) => {
    const page = await opened(context, await daemon.view(PAGE));
    await drawn(page);
    await page.locator('.stream', { hasText: 'walker' }).click();
    const field = page.getByLabel('Amount of style, α, number');
    let alpha = 0.2;
    const effect_ms = async () => {
      alpha += 0.1;
      await field.fill(alpha.toFixed(1));
      await field.press('Enter');
      await acknowledged(page, `walker: amount ${alpha.toFixed(2)}: applied at frame`);
      return Number(/\((\d+) ms\)/.exec(await page.locator('.ack').first().innerText())[1]);
    };
    assert.ok((await askedAgain(effect_ms, (ms) => ms < 1000)) < 1000); // 300 on a quiet machine
    assert.ok(Math.abs((await statsOf('walker')).alphaTarget - alpha) < 1e-6);
    await page.getByText('Share of the style by body part').click();
    await page.getByLabel('head, number').fill('0');
    await page.getByLabel('head, number').press('Enter');
    await acknowledged(page, 'head=0: applied');
    await page.getByLabel('head, number').fill('1');
    await page.getByLabel('head, number').press('Enter');
    await acknowledged(page, 'trunk=1: applied');
    await page.getByLabel('Take name').fill('page');
    await page.getByRole('button', { name: 'Start take' }).click();
    await page.locator('.recording', { hasText: 'take 1 “page”' }).waitFor(PATIENCE);
    await page.getByRole('button', { name: 'End take' }).click();
    await acknowledged(page, 'take ends');
    await page.locator('summary', { hasText: 'Recordings' }).click();
    const clip = page.getByLabel('Download: take-1-walker.page.bvh');
    await clip.waitFor(PATIENCE); // written while the daemon runs, on a thread that others go before
    await page.getByText('take 1 “page”: walker', { exact: true }).waitFor(PATIENCE);
    const [download] = await Promise.all([page.waitForEvent('download', PATIENCE), clip.click()]);
    assert.match(readFileSync(await download.path(), 'utf8'), /^HIERARCHY[^]*MOTION/);
    await page.getByLabel('Model', { exact: true }).selectOption('walk-to-sneak.style');
    await page
      .locator('.side input[type=file]')
      .setInputFiles(join(BUILD, 'demo', 'walk-to-sneak.style'));
    await acknowledged(page, 'model walk-to-sneak.style: applied');
    await page.locator('.stream', { hasText: 'hand' }).click();
    await page.getByLabel('Gestures to play').fill('g 1 c 3 4 p');
    await page.getByRole('button', { name: 'Play', exact: true }).click();
    await acknowledged(page, 'plays g 1 c 3 4 p: applied');
    await page.locator('.name-tag', { hasText: 'plays' }).waitFor(PATIENCE);

    const back_ms = async () => {
      await daemon.stopDaemon();
      await page.locator('.link[data-tone="bad"]').waitFor(PATIENCE);
      await daemon.start();
      const began_ms = performance.now();
      await page.locator('.link[data-tone="good"]').waitFor(PATIENCE);
      await moves(page, 'walker');
      return performance.now() - began_ms;
    };
    const took_ms = await askedAgain(back_ms, (ms) => ms < 3000);
    assert.ok(took_ms < 3000, `${took_ms} ms`);
    assert.deepEqual(page.errors, []);
  },
);

// What the glove's hand does, in the order in which the page asks for it.
const bent = { 1: 80, 2: 100, 3: 60 };
const FIST = Object.fromEntries(
  ['index', 'middle', 'ring', 'little'].flatMap((finger) =>
    Object.entries(bent).map(([joint, angle]) => [`${finger}${joint}_x`, angle]),
  ),
);
const HELD = [
  ['Flat hand', 'flat', {}],
  ['Fist', 'fist', FIST],
  ['Thumb across', 'thumb', { thumb1_z: 45, thumb2_x: 50, thumb3_x: 70 }],
  ['Spread hand', 'spread', { thumb1_y: 25, index1_y: 15, ring1_y: 12, little1_y: 25 }],
];
const PINCH = { thumb1_z: 35, thumb2_x: 20, thumb3_x: 20, index1_x: 45, index2_x: 45, index3_x: 30 };

// For main.mjs, beside the others: a daemon of its own.
export const gloveTest = [
  'an emulated glove is calibrated from the page, then its thumb alone',
  { timeout: 900000 },
  async (context) => {
    const own = new RealDaemon(process.env.POSED, gloveConfig);
    const glove = new EmulatedGlove(own);
    await own.start();
    context.after(async () => {
      await glove.stop();
      await own.stop();
    });
    await glove.hold({});
    const page = await opened(context, await own.view(PAGE));
    const unfold = () => page.locator('summary', { hasText: 'Calibrate this glove' }).click();
    await unfold();
    const lesson = page.locator('details', { hasText: 'Calibrate this glove' });
    const use = lesson.getByRole('button', { name: 'Save and use' });
    assert.ok(await lesson.getByLabel('Hold: Fist', { exact: true }).isDisabled());
    const begin = (ready) =>
      page.evaluate((seconds) => {
        globalThis.posedPage.panel.glove.constructor.seconds = { ready: seconds, hold: 1 };
      }, ready);
    const hold = async (label, pose, angles) => {
      const button = lesson.getByLabel(`Hold: ${label}`, { exact: true });
      const judged = (mark) => lesson.locator(`[data-pose='${pose}']`, { hasText: mark });
      if (pose === 'fist') {
        await begin(1);
        await judged('').evaluate((words) => {
          globalThis.said = [];
          const note = () => globalThis.said.push(words.textContent);
          new MutationObserver(note).observe(words, { childList: true });
        });
        do {
          await button.click(); // the hand is still flat
          await button.and(page.locator(':enabled')).waitFor(PATIENCE);
        } while ((await judged('✗ fist failed').count()) === 0);
        const said = await page.evaluate(() => globalThis.said);
        assert.deepEqual(said.slice(0, 2), ['Take the pose: 1', 'Hold still: 1']);
        await begin(0);
        assert.ok(await use.isDisabled());
      }
      if (pose !== 'flat') await glove.hold(angles);
      do {
        await button.click(); // again, while posed looks for the glove
        await button.and(page.locator(':enabled')).waitFor(PATIENCE);
      } while ((await judged('✓').count()) === 0);
    };
    const used = async (name, words) => {
      await lesson.getByLabel('Whose hand').fill(name);
      await use.click();
      await lesson.getByText(words).waitFor(PATIENCE);
      return readFileSync(join(own.folder, `${name}.toml`), 'utf8');
    };
    await begin(0);
    for (const one of HELD) await hold(...one);
    const sensors = /\[sensors\][^]*/;
    const [all] = sensors.exec(await used('ann', 'ann.toml is in use'));
    await page.reload(); // what was held is forgotten, the calibration is not
    await unfold();
    await begin(0);
    await hold('Touch thumb and index', 'touch-index', PINCH);
    const [mended] = sensors.exec(await used('ann2', 'ann2.toml is in use'));
    const changed = all.split('\n').filter((line) => !mended.includes(line));
    assert.ok(changed.length > 0 && changed.every((line) => line.startsWith('thumb')), changed.join());
    assert.deepEqual(page.errors, []);
  },
];

told('a page of --read-only can change nothing and says so', options, async (context) => {
  const page = await opened(context, await daemon.view(PAGE, '--read-only'));
  await drawn(page);
  await page.getByText('Controls are off: this page was opened with --read-only').waitFor(PATIENCE);
  assert.ok(await page.getByLabel('Amount of style, α, number').isDisabled());
});

told('without the right token there is no page and no stream', options, async (context) => {
  const url = new URL(await daemon.view(PAGE));
  assert.equal((await fetch(url.origin)).status, 403);
  url.searchParams.set('token', 'guess');
  const page = await opened(context, url.href);
  assert.match(await page.locator('body').innerText(), /URL|address/);
});
