// node measure.mjs [SECONDS]: how the page keeps up with 4 performers and 2 hands at 120 Hz: script
// time of a picture, arrival to callback, glass to glass, pictures a second, growth of memory, and
// the time until it is ready. Prints figures and asserts nothing: they are those of this machine.
import { FakeBridge } from '../support/fake_bridge.mjs';
import { FakeDaemon } from '../support/fake_daemon.mjs';
import { launch, openPage } from '../support/browser.mjs';

const seconds = Number(process.argv[2] ?? 60);
const WARM_MS = 8000;

const bridge = await new FakeBridge(new FakeDaemon({ bodies: 4, hands: 2, rate_hz: 120 })).start();
const browser = await launch();
const began_ms = performance.now();
const page = await openPage(browser, bridge.url);
await page.waitForFunction(() => globalThis.posedPage?.store.stats !== null, undefined, {
  polling: 20,
});
console.log(`ready: ${(performance.now() - began_ms).toFixed(0)} ms until the streams are there`);
await page.waitForTimeout(WARM_MS); // shaders are compiled, the pace is found

// From here on: the first pictures, which compile shaders, do not count.
await page.evaluate(() => {
  const { times, store, instruments } = globalThis.posedPage;
  times.clear();
  for (const stream of store.streams.values()) {
    instruments.history(stream).callback.clear();
    instruments.history(stream).latency.clear();
  }
});

const figures = () =>
  page.evaluate(() => {
    const { times, instruments, chosen } = globalThis.posedPage;
    const { callback, latency } = instruments.history(chosen);
    return {
      script_p95_ms: times.quantile(0.95),
      script_p50_ms: times.quantile(0.5),
      callback_p95_ms: callback.quantile(0, 0.95),
      glass_p95_ms: latency.quantile(1, 0.95),
      pictures: times.count,
      heap_MB: performance.memory.usedJSHeapSize / 1e6,
    };
  });

const first = await figures();
for (let passed_s = 0; passed_s < seconds; passed_s += 10) {
  await page.waitForTimeout(Math.min(10, seconds - passed_s) * 1000);
  const now = await figures();
  const rate = (now.pictures - first.pictures) / Math.min(passed_s + 10, seconds);
  console.log(
    `${passed_s + 10} s: script p50 ${now.script_p50_ms.toFixed(1)} p95 ${now.script_p95_ms.toFixed(1)} ms,`,
    `arrival to callback p95 ${now.callback_p95_ms.toFixed(1)} ms, glass p95 ${now.glass_p95_ms.toFixed(1)} ms,`,
    `${rate.toFixed(1)} pictures/s, heap ${now.heap_MB.toFixed(1)} MB`,
  );
}
await browser.close();
await bridge.stop();
