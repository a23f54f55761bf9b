// The page in headless Chromium on a bridge of the test's own, without posed.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { FakeBridge } from '../support/fake_bridge.mjs';
import { FakeDaemon } from '../support/fake_daemon.mjs';
import { askedAgain, opened, PATIENCE } from '../support/browser.mjs';

const HANGS = { timeout: 900000 };
const AXE = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');

export const tests = []; // what node's test() takes, for main.mjs
const test = (...one) => tests.push(one);

// A bridge that ends with the test, however that ends.
async function started(context, options = {}, port = 0) {
  const daemon = new FakeDaemon({ rate_hz: 30, ...options });
  const bridge = await new FakeBridge(daemon, options).start(port);
  context.after(() => bridge.stop());
  return bridge;
}

// Tests that share a page, because opening one takes seconds where the processor draws. Each begins
// with a daemon of its own. The page may say nothing on the console.
function pageTests(name, options, parts) {
  test(name, HANGS, async (context) => {
    const bridge = await started(context, options);
    const page = await opened(context, bridge.url, options);
    await drawn(page);
    for (const [what, use] of Object.entries(parts)) {
      await context.test(what, async () => {
        await begin(page, bridge, options);
        await use(page, bridge);
        assert.deepEqual(page.errors, []);
      });
    }
  });
}

// A new daemon with nothing set, for a page that forgets what the last test has left on it.
async function begin(page, bridge, options) {
  const { frames, began } = bridge.daemon;
  bridge.daemon = Object.assign(new FakeDaemon({ rate_hz: 30, ...options }), { frames, began });
  bridge.requests = [];
  delete bridge.publishStats; // of a test that had one of its own
  const before_ms = await page.evaluate(() => {
    document.activeElement?.blur();
    for (const ack of document.querySelectorAll('.ack')) ack.remove();
    return globalThis.posedPage.store.stats_at_ms;
  });
  bridge.publishStats();
  await page.waitForFunction(
    (was_ms) => globalThis.posedPage.store.stats_at_ms > was_ms,
    before_ms,
    PATIENCE,
  );
  if (bridge.daemon.bodies.length === 0) return;
  await page.locator('.stream', { hasText: 'walker' }).first().click();
  const alpha = await page.getByLabel('Amount of style, α, number').elementHandle();
  await page.waitForFunction((field) => field.value === '1.00', alpha, PATIENCE);
}

// Folds a part of the panel out, if it is not.
async function unfold(page, title) {
  const summary = page.locator('summary', { hasText: title });
  await summary.waitFor(PATIENCE);
  if (!(await summary.evaluate(({ parentElement }) => parentElement.open))) await summary.click();
}

const drawn = (page) => page.locator('.name-tag:visible').first().waitFor(PATIENCE);
const acknowledged = (page, text) =>
  page.locator('.ack', { hasText: text }).first().waitFor(PATIENCE);

// Where joints of a stream are now.
const places = (page, name) =>
  page.evaluate(
    (stream) => [...globalThis.posedPage.store.streams.get(stream).kinematics.position],
    name,
  );

const tile = (page, name) =>
  page.locator('.tile', { has: page.locator('dt', { hasText: new RegExp(`^${name}$`) }) });

// Long ones first: they begin at once.
pageTests(
  'a page of a body and a hand',
  {},
  {
    'a body and a hand move, and nothing is said on the console': async (page) => {
      for (const name of ['walker', 'walker-raw', 'hand']) {
        const first = await places(page, name);
        await page.waitForFunction(
          ([stream, was]) =>
            globalThis.posedPage.store.streams
              .get(stream)
              .kinematics.position.some((value, i) => Math.abs(value - was[i]) > 0.01),
          [name, first],
          PATIENCE,
        );
      }
      assert.match(
        await page.locator('.name-tag[data-kind="raw"]').first().innerText(),
        /raw, as captured/,
      );
      await page.locator('.link-text', { hasText: 'connected to tcp' }).waitFor(PATIENCE);
    },
    'instruments of a live daemon have its times': async (page) => {
      for (const name of TIMES) await tile(page, name).waitFor(PATIENCE);
    },
    'what comes in and where it goes is listed, with how to connect': async (page) => {
      await unfold(page, 'Inputs and outputs: 4 in, 2 out');
      const ways = page.locator('.ways');
      for (const words of [
        /walker\s*live\s*file; 30\.0 Hz/,
        /stage\s*nothing comes\s*natnet, 192\.168\.1\.20:1510; 12 datagrams lost in the kernel; 3 packets not/,
        /phone\s*absent\s*mocopi/,
        /ZeroMQ\s*sends\s*tcp:\/\/127\.0\.0\.1:5570/,
        /vmc-walker\s*sends\s*vmc, 127\.0\.0\.1:39539; 1,200 messages to 1 receiver\s*VSeeFace/,
      ])
        await ways.locator('li', { hasText: words }).waitFor(PATIENCE);
      await ways.getByText('posed.Client("tcp://127.0.0.1:5570")').waitFor(PATIENCE);
      await ways.locator('summary').click();
    },
    'a page that is slow says how old its picture is, and is not green': async (page) => {
      const link = page.locator('.link');
      await page.evaluate(() => {
        const { clock } = globalThis.posedPage;
        clock.toPage_ms = (monotonic_ms) => monotonic_ms - clock.offset_ms - 8000;
      });
      await page.locator('.link[data-tone="busy"]', { hasText: /slow: picture 8\.\d s old/ }).waitFor(PATIENCE);
      await tile(page, 'Delay until drawn').getByText(/^8\.\d s: this page is slow/).waitFor(PATIENCE);
      await page.evaluate(() => delete globalThis.posedPage.clock.toPage_ms);
      await link.and(page.locator('[data-tone="good"]')).waitFor(PATIENCE);
    },
    'an emptied number field changes nothing': async (page, bridge) => {
      await unfold(page, 'More parameters');
      for (const [label, shown] of [
        ['Amount of style, α, number', '1.00'],
        ['Farthest from the performer (cm)', '8'],
      ]) {
        const field = page.getByLabel(label);
        await field.fill('');
        await field.press('Enter');
        assert.equal(await field.inputValue(), shown);
      }
      assert.ok(bridge.requests.every((request) => !request.set_parameter));
    },
    'each field of More parameters sends what the daemon takes': async (page, bridge) => {
      await unfold(page, 'More parameters');
      const root = page.getByLabel('Where the body is');
      assert.equal(await root.inputValue(), 'stride');
      await root.selectOption('actor');
      await acknowledged(page, 'Where the body is actor: applied');
      assert.equal(bridge.daemon.bodies[0].root, 2);
      const limit = page.getByLabel('Farthest from the performer (cm)');
      await limit.fill('5.5');
      await limit.press('Enter');
      await acknowledged(page, 'the performer (cm) 5.5: applied');
      await page.getByLabel('Fade out in unknown motion').click();
      await acknowledged(page, 'Fade out in unknown motion ');
      assert.equal(await page.locator('.ack[data-tone="bad"]').count(), 0);
      await limit.fill('-3');
      await limit.press('Enter');
      await acknowledged(page, 'the performer (cm) -3: refused');
      assert.equal(await limit.inputValue(), '5.5');
    },
    'the slider sets alpha, and the answer is shown; a refusal, too': async (page, bridge) => {
      const field = page.getByLabel('Amount of style, α, number');
      await field.fill('0.35');
      await field.press('Enter');
      await acknowledged(page, 'applied at frame');
      assert.equal(bridge.daemon.bodies[0].target, 0.35);
      await field.fill('7');
      await field.press('Enter');
      await acknowledged(page, 'refused: style.alpha');
      await page.waitForFunction(
        (input) => input.value === '0.35',
        await field.elementHandle(),
        PATIENCE,
      );
    },
    'keys: arrows choose and change, ? explains, fields type': async (page, bridge) => {
      await page.locator('.stage canvas').focus();
      await page.keyboard.press('ArrowLeft');
      await acknowledged(page, 'amount 0.95');
      assert.equal(bridge.daemon.bodies[0].target, 0.95);
      await page.keyboard.press('?');
      await page.locator('#help[open]').waitFor(PATIENCE);
      const own = (selector) =>
        page
          .locator(selector)
          .first()
          .evaluate((item) => item.style.getPropertyValue('--own'));
      for (const key of ['performer', 'contact', 'no-value'])
        assert.equal(await own(`#help [data-key=${key}]`), await own(`.legend [data-key=${key}]`));
      await page.keyboard.press('Escape');
      await page.locator('#help').waitFor({ state: 'hidden', ...PATIENCE });
      await page.keyboard.press('ArrowDown');
      await page.locator('.stream[aria-checked="true"]', { hasText: 'hand' }).waitFor(PATIENCE);
      await page.keyboard.press('g');
      await page.keyboard.type('g 1 r');
      assert.equal(await page.getByLabel('Gestures to play').inputValue(), 'g 1 r');
    },
    'takes, models, mask and weights become requests of the daemon': async (page, bridge) => {
      await page.getByLabel('Take name').fill('walk-3');
      await page.getByRole('button', { name: 'Start take' }).click();
      await page.locator('.recording', { hasText: 'take 1 “walk-3”' }).waitFor(PATIENCE);
      await page.getByRole('button', { name: 'End take' }).click();
      await acknowledged(page, 'take ends');
      await page.getByLabel('Model', { exact: true }).selectOption('tired.style');
      await acknowledged(page, 'model tired.style: applied');
      await page
        .locator('.side input[type=file]')
        .setInputFiles({ name: 'own.style', mimeType: '', buffer: Buffer.alloc(70000, 1) });
      await acknowledged(page, 'model own.style: applied');
      assert.equal(bridge.requests.filter((request) => request.model_part).length, 3);
      await unfold(page, 'Share of the style by body part');
      await page.getByLabel('head, number').fill('0.25');
      await page.getByLabel('head, number').press('Enter');
      await acknowledged(page, 'head=0.25');
      assert.equal(bridge.daemon.bodies[0].mask, 'head=0.25');
      await page.getByLabel('sway, number').fill('0.4');
      await page.getByLabel('sway, number').press('Enter');
      await acknowledged(page, 'sway=0.40');
      assert.equal(bridge.daemon.bodies[0].weights, 'sway=0.40,march=0.30');
    },
    'the model before is one click away, and back again': async (page, bridge) => {
      await page.getByLabel('Model', { exact: true }).selectOption('tired.style');
      await acknowledged(page, 'model tired.style: applied');
      await page.getByRole('button', { name: 'Back to march-to-sway.style' }).click();
      await page.getByRole('button', { name: 'Back to tired.style' }).waitFor(PATIENCE);
      assert.equal(bridge.daemon.bodies[0].model, 'march-to-sway.style');
    },
    'the style is taken off, and put on again': async (page, bridge) => {
      await page.getByLabel('Model', { exact: true }).selectOption('none');
      await acknowledged(page, 'model none: applied');
      await page.getByText('No style is in use').waitFor(PATIENCE);
      assert.equal(bridge.daemon.bodies[0].model, '');
      await page.getByRole('button', { name: 'Back to march-to-sway.style' }).click();
      await acknowledged(page, 'model march-to-sway.style: applied');
    },
    "the daemon's models are used, renamed, and deleted when that is confirmed": async (
      page,
      bridge,
    ) => {
      await unfold(page, 'Library of models');
      const shelf = page.locator('.shelves');
      const button = (name) => shelf.getByRole('button', { name, exact: true });
      await shelf.getByText('turns march into sway, from 12 clips of ann').waitFor(PATIENCE);
      await button('Delete: march-to-sway.style').click();
      await button('Delete').click();
      await acknowledged(page, "refused: 'walker' uses it");
      await button('Keep as it is').click();
      const strips = shelf.getByRole('img'); // of the model that has a sound one
      assert.equal(await strips.count(), 1);
      assert.match(await strips.getAttribute('aria-label'), /march-to-sway.style/);
      await button('Use for walker: tired.style').click();
      await acknowledged(page, 'model tired.style: applied');
      await button('Use: hand.gesture').click();
      await acknowledged(page, 'choose one in the list of streams');
      await button('Delete: march-to-sway.style').click();
      await button('Keep as it is').click();
      await button('Rename: march-to-sway.style').click();
      await shelf.getByLabel('New name of march-to-sway.style').fill('sway');
      await button('Rename').click();
      await shelf.getByText('sway.style', { exact: true }).waitFor(PATIENCE);
      const choice = page.getByLabel('Model', { exact: true });
      await choice.locator('option', { hasText: /^sway.style$/ }).waitFor({ ...PATIENCE, state: 'attached' });
      // A key that is held answers no question.
      await button('Delete: sway.style').focus();
      for (let i = 0; i < 5; i += 1) await page.keyboard.down('Enter');
      await page.keyboard.up('Enter');
      assert.equal(bridge.daemon.models.length, 3);
      await button('Delete').click();
      await acknowledged(page, 'delete sway.style: done');
      assert.equal(bridge.daemon.models.length, 2);
      await page.locator('summary', { hasText: 'Library of models' }).click();
    },
    'a recording is downloaded whole; what is not there yet is said, not offered': async (
      page,
      bridge,
    ) => {
      const coming = { name: '20261126T065505Z-3-walker.bvh', being_made: true };
      const failed = { name: '20261126T065505Z-4-walker.bvh', problem: 'exists already' };
      bridge.daemon.recordings.push(coming, failed);
      await unfold(page, 'Recordings');
      await page.locator('li', { hasText: 'take 3: walkerbeing made' }).waitFor(PATIENCE);
      await page.locator('li', { hasText: 'take 4: walkernot made: exists already' }).waitFor(PATIENCE);
      bridge.daemon.recordings.splice(-2);
      assert.ok(await page.getByLabel('being written: 20261126T065505Z.plog').isDisabled());
      const [download] = await Promise.all([
        page.waitForEvent('download', PATIENCE),
        page.getByLabel('Download: 20261126T065505Z-1-walker.bvh').click(),
      ]);
      assert.equal(download.suggestedFilename(), '20261126T065505Z-1-walker.bvh');
      const bytes = readFileSync(await download.path());
      assert.equal(bytes.length, 70000);
      assert.ok(bytes.every((byte, i) => byte === i % 251));
      await page.locator('summary', { hasText: 'Recordings' }).click();
    },
    'a take plays beside the live ones, as a whole or a part of it': async (page) => {
      await unfold(page, 'Recordings');
      const file = '20261126T065505Z-2-walker.bvh';
      await page.getByLabel('Play: 20261126T065505Z-1-walker.bvh').click();
      await acknowledged(page, 'cannot be played: it is no BVH');
      await page.getByLabel(`Play: ${file}`).click();
      const entry = page.locator('.legend li', { hasText: 'take 2: walker: recorded' });
      await entry.waitFor(PATIENCE);
      const own = (text) =>
        page
          .locator('.legend li', { hasText: text })
          .first()
          .evaluate((item) => item.style.getPropertyValue('--own'));
      assert.notEqual(await own('take 2: walker'), await own('walker: styled'));
      const before = await places(page, 'take 2: walker');
      const moved = ([name, was]) =>
        globalThis.posedPage.store.streams
          .get(name)
          .kinematics.position.some((value, i) => Math.abs(value - was[i]) > 0.01);
      await page.waitForFunction(moved, ['take 2: walker', before], PATIENCE);
      await page.waitForFunction(moved, ['walker', await places(page, 'walker')], PATIENCE);
      assert.equal(await page.locator('.stream', { hasText: 'take 2' }).count(), 0);
      await page.getByLabel('From, s').fill('0.5');
      await page.getByLabel('To, s').fill('99');
      await page.getByLabel('From, s').focus();
      assert.equal(await page.getByLabel('To, s').inputValue(), '2.00');
      const [part] = await Promise.all([
        page.waitForEvent('download', PATIENCE),
        page.getByRole('button', { name: 'Download this part' }).click(),
      ]);
      assert.equal(part.suggestedFilename(), '20261126T065505Z-2-walker-0.5s-2s.bvh');
      const lines = readFileSync(await part.path(), 'utf8').split('\n');
      const head = lines.findIndex((line) => line === 'Frames: 45');
      assert.equal(lines.length, head + 2 + 45 + 1);
      for (const kind of ['glb', 'vrma']) {
        const [made] = await Promise.all([
          page.waitForEvent('download', PATIENCE),
          page.getByRole('button', { name: `As ${kind.toUpperCase()}` }).click(),
        ]);
        assert.equal(made.suggestedFilename(), `20261126T065505Z-2-walker-0.5s-2s.${kind}`);
        assert.equal(readFileSync(await made.path(), 'utf8'), `${kind} from 0.5 to 2`);
      }
      await page.getByLabel(`Stop: ${file}`).click();
      await entry.waitFor({ state: 'hidden', ...PATIENCE });
      await page.locator('summary', { hasText: 'Recordings' }).click();
    },
    'a picture and a video of the scene are files': async (page) => {
      const [picture] = await Promise.all([
        page.waitForEvent('download', PATIENCE),
        page.getByRole('button', { name: 'Screenshot' }).click(),
      ]);
      assert.match(picture.suggestedFilename(), /^posed-\d{8}T\d{6}\.png$/);
      assert.equal(readFileSync(await picture.path()).toString('latin1', 1, 4), 'PNG');
      const [video] = await Promise.all([
        page.waitForEvent('download', PATIENCE),
        // A busy machine draws few pictures a second.
        page.evaluate(() => globalThis.posedPage.capture.video(() => {}, 3)),
      ]);
      assert.match(video.suggestedFilename(), /\.webm$/);
      assert.ok(readFileSync(await video.path()).length > 1000);
    },
    'the scene stops, goes back, and is live again': async (page) => {
      const first = await places(page, 'walker');
      await page.waitForTimeout(1000);
      await page.locator('.stage canvas').focus();
      await page.keyboard.press('p');
      const range = page.getByLabel('Seconds before the pause');
      await page.locator('.link[data-tone="busy"]', { hasText: 'paused' }).waitFor(PATIENCE);
      await page.waitForTimeout(500);
      const stopped = await places(page, 'walker');
      await page.waitForTimeout(500);
      assert.deepEqual(await places(page, 'walker'), stopped);
      await range.fill('-1');
      const back = ([stream, was]) =>
        globalThis.posedPage.store.streams
          .get(stream)
          .kinematics.position.some((value, i) => Math.abs(value - was[i]) > 0.01);
      await page.waitForFunction(back, ['walker', stopped], PATIENCE);
      const past = await places(page, 'walker');
      assert.notDeepEqual(past, first);
      await page.getByText('Paused: 1.0 s back').waitFor(PATIENCE);
      await page.getByRole('button', { name: 'Back to live' }).click();
      await page.locator('.link[data-tone="good"]').waitFor(PATIENCE);
      await page.waitForFunction(back, ['walker', past], PATIENCE);
      assert.ok(await range.isHidden());
    },
    'who starts a take while the disk is full is told so': async (page, bridge) => {
      bridge.daemon.recorder_trouble = 'take1.plog: the disk is full';
      await page.getByLabel('Take name').fill('');
      await page.getByRole('button', { name: 'Start take' }).click();
      await acknowledged(page, 'nothing can be written to the log: take1.plog: the disk is full');
      await page.locator('.recording', { hasText: ', NOTHING IS WRITTEN' }).waitFor(PATIENCE);
    },
    'a held key or two quick presses make one take': async (page, bridge) => {
      bridge.publishStats = () => {}; // the answers alone say whether a take runs
      const takes = () =>
        bridge.requests.flatMap(({ take }) => (take ? [Boolean(take.start)] : []));
      await page.evaluate(() => {
        globalThis.posedPage.takes.toggle();
        globalThis.posedPage.takes.toggle();
      });
      await acknowledged(page, 'begins');
      assert.deepEqual(takes(), [true]);
      await page.keyboard.press('ArrowDown'); // the panels are written again, with the old statistics
      await page.locator('.stage canvas').focus();
      for (let i = 0; i < 3; i += 1) {
        await page.keyboard.down('s'); // again without up: the key repeats
        await page.waitForTimeout(200);
      }
      await page.keyboard.up('s');
      await acknowledged(page, 'take ends');
      assert.deepEqual(takes(), [true, false]);
    },
    "a stream's name is not broken to make room for its figures": async (page) => {
      const lines = await page
        .locator('.stream', { hasText: 'hand' })
        .first()
        .evaluate((row) => {
          const whole = row.cloneNode(true);
          whole.querySelector('strong').textContent = 'camera-right';
          for (const number of whole.querySelectorAll('.number')) number.textContent = '109 ms delay';
          row.parentElement.append(whole);
          const name = document.createRange();
          name.selectNodeContents(whole.querySelector('strong'));
          const { length } = name.getClientRects();
          whole.remove();
          return length;
        });
      assert.equal(lines, 1);
    },
    'a daemon that does not record says how to': async (page, bridge) => {
      bridge.daemon.recording = false;
      bridge.publishStats();
      const words = page.locator('.recording', { hasText: 'not recording' });
      await words.waitFor(PATIENCE);
      assert.match(await words.getAttribute('title'), /posed record/);
      assert.equal(await page.getByLabel('Take name').isVisible(), false);
      await page.locator('.stage canvas').focus();
      await page.keyboard.press('s');
      const why = page.locator('.ack', { hasText: 'no take begins, because posed does not record' });
      await why.waitFor(PATIENCE);
      await page.getByRole('button', { name: 'Start take' }).click(); // where nothing can hover, too
      await why.nth(1).waitFor(PATIENCE);
      assert.ok(bridge.requests.every((request) => !request.take));
    },
    "the hands' view stays as turned, and a still scene rests": async (page, bridge) => {
      const turned = async () => {
        const was = await page.evaluate(() => {
          const { camera } = globalThis.posedPage.world.hands;
          camera.position.set(0.6, 0.1, 0.6);
          return camera.position.toArray();
        });
        for (let i = 0; i < 3; i += 1) {
          await page.waitForTimeout(400);
          bridge.publishStats();
        }
        const now = await page.evaluate(() =>
          globalThis.posedPage.world.hands.camera.position.toArray(),
        );
        return Math.max(...now.map((value, i) => Math.abs(value - was[i])));
      };
      // Parts of the page that get their sizes late turn the view once; statistics must not.
      const still = (by_m) => by_m < 0.01;
      assert.ok(still(await askedAgain(turned, still)));
      bridge.daemon.rate_hz = 0; // no poses any more, but statistics
      await page.waitForFunction(
        async () => {
          const { render } = globalThis.posedPage.world.renderer.info;
          const before = render.frame;
          for (let i = 0; i < 8; i += 1) await new Promise(requestAnimationFrame);
          return render.frame === before;
        },
        undefined,
        PATIENCE,
      );
    },
    'axe-core finds no fault': accessible,
  },
);

// Nobody takes his place here.
const hurry = (page) =>
  page.evaluate(() => {
    globalThis.posedPage.panel.lesson.constructor.ready_s = 0;
  });

pageTests(
  'a page of a body and a hand that are taught',
  {},
  {
    'a style is taught by two walks': async (page, bridge) => {
      await unfold(page, 'Teach a style');
      await hurry(page);
      const lesson = page.locator('details', { hasText: 'Teach a style' });
      const learn = lesson.getByRole('button', { name: 'Learn' });
      const walk = (how) => lesson.getByLabel(`Walk ${how}`);
      await walk('as usual').click();
      await lesson.getByText(/^\d+ s …/).waitFor(PATIENCE);
      assert.ok(await walk('in the style').isDisabled());
      await lesson.getByText('✓ 18 strides in 20.0 s').waitFor(PATIENCE);
      await lesson.getByText('To learn: a good walk in the style.').waitFor(PATIENCE);
      await walk('in the style').click();
      await lesson.getByText('so far: 4 strides').waitFor(PATIENCE);
      await lesson.getByText('✗ this is no walk').waitFor(PATIENCE);
      await lesson.getByLabel('Name').fill('proud');
      assert.ok(await learn.isDisabled());
      await walk('in the style').click();
      await lesson.getByText('✓ 18 strides in 20.0 s').nth(1).waitFor(PATIENCE);
      await lesson.getByLabel('Name').fill('../proud');
      assert.ok(await learn.isDisabled());
      await lesson.getByLabel('Name').fill('proud');
      await learn.click();
      await lesson.getByText('proud.style is in use 1.5 s after').waitFor(PATIENCE);
      assert.equal(bridge.daemon.bodies[0].model, 'proud.style');
      await lesson.getByRole('button', { name: 'One more' }).first().click();
      await lesson.getByText('; 2 good walks are kept').waitFor(PATIENCE);
      assert.ok(await learn.isEnabled());
    },
    'a hand is taught signs': async (page, bridge) => {
      await page.locator('.stream', { hasText: 'hand' }).click();
      await unfold(page, 'Teach signs');
      await hurry(page);
      const lesson = page.locator('details', { hasText: 'Teach signs' });
      const learn = lesson.getByRole('button', { name: 'Learn' });
      const begin = lesson.getByRole('button', { name: 'Show 5 s' });
      await lesson.getByLabel('Sign to show').fill('two words');
      assert.ok(await begin.isDisabled());
      await lesson.getByLabel('Sign to show').fill('ok');
      await lesson.getByLabel('Name').fill('mine');
      for (const verdict of ['✓ held', '✗ the hand moved too much', '✓ held', '✓ held']) {
        assert.ok(await learn.isDisabled());
        await begin.click();
        await lesson.getByText(/^\d+ s …/).waitFor(PATIENCE);
        await begin.waitFor(PATIENCE);
        await lesson.getByText(verdict).waitFor(PATIENCE);
      }
      await lesson.getByRole('button', { name: 'ok 3/3' }).waitFor(PATIENCE);
      await learn.click();
      await lesson.getByText('mine.gesture is in use 0.5 s after').waitFor(PATIENCE);
      assert.ok(bridge.requests.some(({ teach }) => teach?.train?.signs === true));
      const gestures = page.getByLabel('Gestures of the model');
      await gestures.getByRole('button', { name: 'ok', exact: true }).waitFor(PATIENCE);
      await lesson.getByRole('button', { name: 'ok 3/3' }).click();
      await lesson.getByRole('button', { name: 'ok 3/3' }).waitFor({ state: 'detached' });
    },
  },
);

pageTests(
  'a page of four bodies and two hands',
  { bodies: 4, hands: 2, missing: [5, 6, 7, 8], width: 1440, height: 900 },
  {
    'names cover neither each other nor the buttons, whatever the view': async (page) => {
      const tools = await page.locator('.tools').boundingBox();
      // Those that cover something; a text that has just changed has its place in the next picture.
      const covering = async () => {
        await page.waitForTimeout(900); // the view is there, the texts have their sizes
        const boxes = await page.locator('.name-tag:visible').evaluateAll((tags) =>
          tags.map((tag) => {
            const { left, right, top, bottom } = tag.getBoundingClientRect();
            return { left, right, top, bottom };
          }),
        );
        assert.ok(boxes.length >= 4, `${boxes.length} names`);
        const meet = (a, b) =>
          a.right > b.left && b.right > a.left && a.bottom > b.top && b.bottom > a.top;
        return boxes.filter(
          (a, i) =>
            a.top < tools.y + tools.height || boxes.slice(i + 1).some((b) => meet(a, b)),
        );
      };
      for (const view of ['Side', 'Front', 'Follow']) {
        await page.getByRole('button', { name: view, exact: true }).click();
        assert.deepEqual(await askedAgain(covering, ({ length }) => length === 0), [], view);
      }
    },
    'each performer has a colour; follow and orbit keep the chosen one in the picture, alone':
      async (page) => {
        const entries = await page
          .locator('.legend li[data-key="performer"]')
          .evaluateAll((items) =>
            items.map((item) => [item.textContent, item.style.getPropertyValue('--own')]),
          );
        const bodies = ['walker', 'walker2', 'walker3', 'walker4'].map((name) => `${name}: styled`);
        const hands = ['hand', 'hand2'].map((name) => `${name}: smoothed`);
        assert.deepEqual(entries.map(([text]) => text).sort(), [...hands, ...bodies].sort());
        assert.equal(new Set(entries.map(([, colour]) => colour)).size, 6);
        await page.locator('.stream', { hasText: 'walker3' }).click();
        for (const view of ['Follow', 'Orbit']) {
          await page.getByRole('button', { name: view, exact: true }).click();
          await page.waitForTimeout(1000); // he walks on, and the view with him
          const off_m = await page.evaluate(() => {
            const { world } = globalThis.posedPage;
            const [one, raw] = ['walker3', 'walker3-raw'].map((name) => world.performers.get(name));
            const middle = one.centre.clone().lerp(raw.centre, 0.5);
            return Math.hypot(world.views.target.x - middle.x, world.views.target.z - middle.z);
          });
          assert.ok(off_m < 1, `${view}: ${off_m} m`);
        }
      },
  },
);

const rights = { may_control: false, read_only_reason: 'this key may watch only' };
test(
  'a page that may only look says why; once it may control, it asks for the models again',
  HANGS,
  async (context) => {
    const bridge = await started(context, { rights });
    const { daemon } = bridge;
    const { answer } = daemon;
    daemon.answer = () => ({ ok: false, error: 'this key may watch only' });
    const page = await opened(context, bridge.url);
    await drawn(page);
    const models = page.getByLabel('Model', { exact: true });
    await page.locator('select[title*="this key may watch only"]').waitFor(PATIENCE);
    await page.getByText('Controls are off: this key may watch only').waitFor(PATIENCE);
    assert.ok(await page.getByLabel('Amount of style, α, number').isDisabled());
    await page.locator('.stage canvas').focus();
    await page.keyboard.press('ArrowLeft');
    await page.keyboard.press('s');
    assert.deepEqual(
      bridge.requests.filter((request) => !request.list_models),
      [],
    );
    daemon.answer = answer;
    bridge.say({ type: 'control', may_control: true, read_only_reason: '' });
    await models.locator('option[value="tired.style"]').waitFor({ state: 'attached', ...PATIENCE });
    assert.ok(await models.isEnabled());
  },
);

// As where a virtual machine or a policy has it switched off.
const withoutWebGL = (page) =>
  page.addInitScript(() => {
    const { getContext } = HTMLCanvasElement.prototype;
    HTMLCanvasElement.prototype.getContext = function of(kind, ...more) {
      return kind.startsWith('webgl') ? null : getContext.call(this, kind, ...more);
    };
  });

test('without WebGL the page says what to do', HANGS, async (context) => {
  const bridge = await started(context);
  const page = await opened(context, bridge.url, { before: withoutWebGL });
  await page.locator('.link-text', { hasText: 'this browser draws no WebGL' }).waitFor(PATIENCE);
  bridge.publishStats();
  await page.waitForTimeout(500); // what the bridge sends is no error
  assert.match(await page.locator('.link-text').innerText(), /hardware acceleration/);
  assert.ok(
    page.errors.every((text) => text.includes('WebGL')),
    page.errors.join(),
  );
});

test('a page that loses its bridge says so, and finds it again', HANGS, async (context) => {
  let bridge = await started(context);
  const page = await opened(context, bridge.url.replace('secret', 'guess'));
  assert.match(await page.locator('body').innerText(), /refused/); // without the token nothing
  await page.goto(bridge.url);
  await drawn(page);
  bridge.silence();
  await page.locator('.link[data-tone="bad"]', { hasText: 'does not answer' }).waitFor(PATIENCE);
  await page.locator('.stream .state', { hasText: 'unknown' }).first().waitFor(PATIENCE);
  const { port } = bridge;
  const back_ms = async () => {
    await bridge.stop();
    await page.locator('.link[data-tone="busy"]').waitFor(PATIENCE);
    await page.getByText('Controls are off: there is no connection').waitFor(PATIENCE);
    assert.equal(await page.locator('.machine').innerText(), '');
    const began_ms = performance.now();
    bridge = await started(context, {}, port);
    await page.locator('.link[data-tone="good"]').waitFor(PATIENCE);
    return performance.now() - began_ms;
  };
  const took_ms = await askedAgain(back_ms, (ms) => ms < 3000);
  assert.ok(took_ms < 3000, `${took_ms} ms`);
  await bridge.stop();
  await started(context, { token: 'another' }, port);
  await page
    .locator('.link-text', { hasText: 'refused this page: open the URL' })
    .waitFor(PATIENCE);
});

// Drops a file of the page's own address on the scene, under another name.
const drop = (page, path, name) =>
  page.evaluate(
    async ([source, as]) => {
      const bytes = await (await fetch(source)).arrayBuffer();
      const dataTransfer = new DataTransfer();
      dataTransfer.items.add(new File([bytes], as));
      document
        .querySelector('.stage')
        .dispatchEvent(new DragEvent('drop', { dataTransfer, bubbles: true, cancelable: true }));
    },
    [path, name],
  );

const wears = (page, name) =>
  page.waitForFunction(
    (avatar) => globalThis.posedPage?.world.performers.get('walker')?.avatar?.name === avatar,
    name,
    PATIENCE,
  );

const TIMES = ['Delay to this page', 'Delay until drawn'];

async function withoutTimes(page) {
  await page.getByText('Time in each step').waitFor(PATIENCE);
  await tile(page, 'Rate').waitFor(PATIENCE);
  for (const name of TIMES) await tile(page, name).waitFor({ state: 'hidden', ...PATIENCE });
}

// axe-core looks at contrast, names for screen readers, and the reach of the keyboard; not at what
// is drawn, so nothing is drawn meanwhile.
async function accessible(page) {
  await page.evaluate(() => {
    globalThis.posedPage.world.frame = () => false;
  });
  for (const part of await page.locator('summary:visible').all()) await part.click();
  await page.evaluate(AXE);
  const faults = (part) =>
    page.evaluate(async (selector) => {
      const { violations } = await globalThis.axe.run(selector);
      return violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ target }) => target)}`);
    }, part);
  assert.deepEqual(await faults('html'), []);
  await page.locator('#help-button').click();
  for (const summary of await page.locator('#help summary').all()) await summary.click();
  assert.deepEqual(await faults('#help'), []);
}

pageTests(
  'a page of a hand of another machine, in the dark',
  { dark: true, bodies: 0, same_machine: false },
  {
    'instruments: all but the times of the page': withoutTimes,
    'a line of gestures is performed, an unknown one refused; chips write the line': async (
      page,
      bridge,
    ) => {
      const line = page.getByLabel('Gestures to play');
      await line.fill('g 1 x');
      await page.getByRole('button', { name: 'Play' }).click();
      await acknowledged(page, 'does not know');
      await line.fill('g 1');
      await page.locator('.chip', { hasText: 'c' }).click();
      await page.getByRole('button', { name: 'Play' }).click();
      await acknowledged(page, 'plays g 1 c');
      assert.deepEqual(bridge.daemon.hands[0].play, ['g', '1', 'c']);
      bridge.daemon.hands[0].loop = true; // until it is stopped, however slowly the page draws
      await page.locator('.name-tag', { hasText: 'plays' }).waitFor(PATIENCE);
      await page.getByRole('button', { name: 'Stop' }).click();
      await acknowledged(page, 'plays no more');
      assert.match(await page.locator('.chosen code').innerText(), /posed calibrate .*--stream hand/);
    },
    'axe-core finds no fault': accessible,
  },
);

pageTests(
  'a page of a body in a replay',
  { hands: 0, replay_file: 'take1.plog' },
  {
    'instruments: all but the times of the page': withoutTimes,
    'a body wears the mannequin, in its colour': async (page) => {
      await page.waitForFunction(
        () => globalThis.posedPage.world.performers.get('walker').avatar !== null,
        undefined,
        PATIENCE,
      );
      const gap_m = await page.evaluate(() => {
        const { avatar, stream } = globalThis.posedPage.world.performers.get('walker');
        const head = avatar.vrm.humanoid.getRawBoneNode('head');
        head.updateWorldMatrix(true, false);
        const joint = stream.kinematics.jointOf('head');
        return Math.abs(head.matrixWorld.elements[13] - stream.kinematics.position[3 * joint + 1]);
      });
      assert.ok(gap_m < 0.15, String(gap_m));
      const swatch = page.locator('.legend li', { hasText: 'walker: styled' });
      const own = await swatch.evaluate((item) => item.style.getPropertyValue('--own'));
      const painted = await page.evaluate(() => {
        const { avatar, colour } = globalThis.posedPage.world.performers.get('walker');
        let seen = '';
        avatar.vrm.scene.traverse(({ isSkinnedMesh, geometry, material }) => {
          const { color } = geometry?.attributes ?? {};
          if (isSkinnedMesh) seen = material.color.clone().fromArray(color.array);
        });
        return [`#${seen.getHexString()}`, colour];
      });
      assert.deepEqual(painted, [own, own]);
    },
    'a dropped avatar is worn, another file refused with a sentence': async (page) => {
      await drop(page, '/mannequin.vrm', 'Ann.vrm');
      await page.waitForFunction(
        () => globalThis.posedPage.world.performers.get('walker').avatar?.name === 'Ann',
        undefined,
        PATIENCE,
      );
      await drop(page, '/page.css', 'notes.txt');
      await acknowledged(page, 'notes.txt cannot be read as VRM');
      await page.getByRole('button', { name: 'Settings' }).click();
      assert.equal(await page.getByLabel('All bodies', { exact: true }).inputValue(), 'Ann');
    },
    'settings change the scene, and are remembered with the avatar of each performer': async (
      page,
    ) => {
      await page.reload();
      await drawn(page);
      await wears(page, 'Ann');
      await page.getByRole('button', { name: 'Settings' }).click();
      const settings = page.locator('#settings');
      await settings.getByLabel('walker', { exact: true }).selectOption('bones');
      await wears(page, undefined);
      await settings.getByLabel('Floor').uncheck();
      await settings.getByLabel('Names').uncheck();
      await settings.getByLabel('Background').selectOption('green, to key out');
      await settings.getByLabel('Picture').selectOption('always quick');
      const seen = () =>
        page.evaluate(() => {
          const { world } = globalThis.posedPage;
          return [
            world.ground.group.visible,
            world.scene.background.getHexString(),
            world.renderer.getPixelRatio(),
            getComputedStyle(document.querySelector('.name-tags')).display,
          ];
        });
      assert.deepEqual(await seen(), [false, '00b140', 0.5, 'none']);
      await settings.getByRole('button', { name: 'Close' }).click();
      await page.reload();
      await page.waitForFunction(
        () => globalThis.posedPage?.world.performers.get('walker'),
        undefined,
        PATIENCE,
      );
      assert.deepEqual(await seen(), [false, '00b140', 0.5, 'none']);
      await page.keyboard.press('o');
      assert.equal(await settings.getByLabel('walker', { exact: true }).inputValue(), '');
      await settings.getByRole('button', { name: 'Forget Ann' }).click();
      await settings.getByText('Ann is kept').waitFor({ state: 'detached', ...PATIENCE });
      await settings.getByLabel('walker', { exact: true }).selectOption('as all');
      await wears(page, 'mannequin');
    },
    'axe-core finds no fault': accessible,
  },
);

pageTests(
  'a page on a phone, of a predicted body without an arm',
  { dark: true, missing: [5, 6, 7, 8], width: 390, height: 844 },
  {
    'the pose is said to be predicted, and what has no value': async (page) => {
      const words = /predicted\s· no value: left arm/;
      await page.locator('.name-tag[data-kind="styled"]', { hasText: words }).waitFor(PATIENCE);
      await page.locator('.legend li[data-key="no-value"]').waitFor(PATIENCE);
    },
    'on a phone nothing is wider than the screen': async (page) => {
      assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), 390);
    },
    'axe-core finds no fault': accessible,
  },
);
