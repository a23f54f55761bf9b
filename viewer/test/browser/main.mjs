// node main.mjs: the tests of the page in a browser; with POSED=path/to/posed also with the daemon.
import { hasBrowser } from '../support/browser.mjs';

if (hasBrowser()) {
  await import('./page_test.mjs');
  await import('./camera_test.mjs');
  if (process.env.POSED) await import('./daemon_test.mjs');
} else {
  console.log('SKIPPED without chromium');
}
