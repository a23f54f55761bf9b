// Headless Chromium for the tests, as Debian has it.
import { existsSync } from 'node:fs';
import { chromium } from 'playwright-core';
import { handFilm } from './rendered_hand.mjs';

export const CHROMIUM = process.env.POSED_CHROMIUM ?? '/usr/bin/chromium';
export const hasBrowser = () => existsSync(CHROMIUM);

const FLAGS = [
  '--disable-quic',
  '--no-first-run',
  '--disable-background-networking',
  '--disable-component-update',
  '--disable-sync',
  // Draws WebGL without a graphics card.
  '--use-gl=angle',
  '--use-angle=swiftshader',
  '--enable-unsafe-swiftshader',
  // WebGL alone: the page around it is put together in half the time without it.
  '--disable-gpu-compositing',
];

// A camera that shows this film, and a user who lets the page use it.
const withCamera = (film) => [
  ...FLAGS,
  '--use-fake-device-for-media-stream',
  '--use-fake-ui-for-media-stream',
  `--use-file-for-fake-video-capture=${film}`,
];

export const launch = (flags = FLAGS) =>
  chromium.launch({ executablePath: CHROMIUM, args: ['--no-sandbox', ...flags] });

// Long enough for a machine that does much else; what never comes still fails.
export const PATIENCE = { timeout: 120000 };

// For what such a machine can spoil: the first answer that is good, or the fourth.
export async function askedAgain(ask, good) {
  let answer = await ask();
  for (let i = 0; i < 3 && !good(answer); i += 1) answer = await ask();
  return answer;
}

// One browser for all tests, whose camera shows a drawn hand.
let shared = null;
export const browserOfAll = () => {
  shared ??= launch(withCamera(handFilm()));
  return shared;
};
export const closeBrowser = async () => (await shared)?.close();

// In the page, before all else: three frames a second, drawn coarsely unless its address says
// `fine`. Where the processor draws, all tests would else wait for pictures that none looks at.
function drawLittle() {
  const { requestAnimationFrame: next } = globalThis;
  globalThis.requestAnimationFrame = (frame) => setTimeout(() => next(frame), 300);
  if (location.protocol === 'http:' && !location.search.includes('fine'))
    localStorage['posed.quality'] ??= 'quick';
}

// A page of that browser that ends with the test, however that ends.
export async function opened(context, url, { before, ...options } = {}) {
  const page = await openPage(await browserOfAll(), 'about:blank', {
    width: 1100,
    height: 750,
    ...options,
  });
  context.after(() => page.context().close());
  await page.addInitScript(drawLittle);
  await before?.(page);
  await page.goto(url);
  return page;
}

// A page that keeps the errors that it says on the console.
export async function openPage(browser, url, { width = 1440, height = 900, dark = false } = {}) {
  const context = await browser.newContext({
    viewport: { width, height },
    colorScheme: dark ? 'dark' : 'light',
  });
  context.setDefaultTimeout(PATIENCE.timeout);
  const page = await context.newPage();
  page.errors = [];
  page.on('console', (message) => {
    if (message.type() === 'error') page.errors.push(message.text());
  });
  page.on('pageerror', (error) => page.errors.push(String(error.stack ?? error)));
  await page.goto(url);
  return page;
}
