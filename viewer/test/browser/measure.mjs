// node measure.mjs [SECONDS [ROUNDS [PAGE...]]]: how the page keeps up with 4 performers and 2
// hands at 120 Hz: pictures a second, script time of a picture, arrival to callback, glass to
// glass, growth of memory, the time until it is ready. What depends least on how busy the machine
// is: the processor's time for a picture, in the page's script and in the process that draws.
// Several folders with pages are measured in turns. Prints figures and asserts nothing: they are
// this machine's.
import { FakeBridge, PAGE } from '../support/fake_bridge.mjs';
import { FakeDaemon } from '../support/fake_daemon.mjs';
import { launch, openPage } from '../support/browser.mjs';

const [seconds = 60, rounds = 1] = process.argv.slice(2, 4).map(Number);
const folders = process.argv.length > 4 ? process.argv.slice(4) : [PAGE];
const WARM_MS = 8000; // shaders are compiled, the pace is found

const figuresOf = (page) =>
  page.evaluate(() => {
    const { times, instruments, chosen, world } = globalThis.posedPage;
    const { callback, latency } = instruments.history(chosen);
    return {
      script_p50_ms: times.quantile(0.5),
      script_p95_ms: times.quantile(0.95),
      callback_p95_ms: callback.quantile(0, 0.95),
      glass_p95_ms: latency.quantile(1, 0.95),
      pictures: times.count,
      heap_MB: performance.memory.usedJSHeapSize / 1e6,
      sharpness: world.renderer.getPixelRatio(),
    };
  });

// From here on: the first pictures, which compile shaders, do not count.
const forget = (page) =>
  page.evaluate(() => {
    const { times, store, instruments } = globalThis.posedPage;
    times.clear();
    for (const stream of store.streams.values()) {
      instruments.history(stream).callback.clear();
      instruments.history(stream).latency.clear();
    }
  });

// The processor's time so far [ms]: of the page's script, of the process that draws.
async function processorOf(browser, page) {
  const own = await page.context().newCDPSession(page);
  await own.send('Performance.enable', { timeDomain: 'threadTicks' });
  const all = await browser.newBrowserCDPSession();
  return async () => {
    const { metrics } = await own.send('Performance.getMetrics');
    const { processInfo } = await all.send('SystemInfo.getProcessInfo');
    const seconds = (list, key, name, value) => list.find((one) => one[key] === name)[value];
    return {
      script_ms: 1000 * seconds(metrics, 'name', 'ScriptDuration', 'value'),
      draw_ms: 1000 * seconds(processInfo, 'type', 'GPU', 'cpuTime'),
    };
  };
}

async function measure(folder) {
  const daemon = new FakeDaemon({ bodies: 4, hands: 2, rate_hz: 120 });
  const bridge = await new FakeBridge(daemon, { folder }).start();
  const browser = await launch();
  const began_ms = performance.now();
  const page = await openPage(browser, bridge.url);
  await page.waitForFunction(() => globalThis.posedPage?.store.stats !== null, undefined, {
    polling: 20,
  });
  console.log(`${folder}: ready after ${(performance.now() - began_ms).toFixed(0)} ms`);
  await page.waitForTimeout(WARM_MS);
  const processor = await processorOf(browser, page);
  await forget(page);
  const [first, before] = [await figuresOf(page), await processor()];
  for (let passed_s = 0; passed_s < seconds; passed_s += 10) {
    await page.waitForTimeout(Math.min(10, seconds - passed_s) * 1000);
    const [now, after] = [await figuresOf(page), await processor()];
    const pictures = now.pictures - first.pictures;
    const each = (name) => `${((after[name] - before[name]) / pictures).toFixed(1)} ms`;
    const rate = pictures / Math.min(passed_s + 10, seconds);
    console.log(
      `${passed_s + 10} s: ${rate.toFixed(1)} pictures/s at ${now.sharpness} of the pixels' width,`,
      `script p50 ${now.script_p50_ms.toFixed(1)} p95 ${now.script_p95_ms.toFixed(1)} ms,`,
      `arrival to callback p95 ${now.callback_p95_ms.toFixed(1)} ms,`,
      `glass p95 ${now.glass_p95_ms.toFixed(1)} ms,`,
      `processor each: script ${each('script_ms')}, drawing ${each('draw_ms')},`,
      `heap ${now.heap_MB.toFixed(1)} MB`,
    );
  }
  await browser.close();
  await bridge.stop();
}

for (let round = 0; round < rounds; round += 1) for (const folder of folders) await measure(folder);
