// node main.mjs: the tests of the page in a browser; with POSED=path/to/posed also with the daemon.
// They mostly wait, so three go on side by side.
import { after, describe, test } from 'node:test';
import { closeBrowser, hasBrowser } from '../support/browser.mjs';

if (hasBrowser()) {
  const { tests: pageTests } = await import('./page_test.mjs');
  const { tests: cameraTests } = await import('./camera_test.mjs');
  const { daemonTests, gloveTest } = await import('./daemon_test.mjs');
  after(closeBrowser);
  describe('the page in a browser', { concurrency: 3 }, () => {
    // In a row: one daemon serves them all.
    if (process.env.POSED) describe('with the daemon', { concurrency: 1 }, daemonTests);
    if (process.env.POSED) test(...gloveTest);
    for (const one of [...pageTests, ...cameraTests]) test(...one);
  });
} else {
  console.log('SKIPPED without chromium');
}
