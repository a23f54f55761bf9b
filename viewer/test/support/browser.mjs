// Headless Chromium for the tests, as Debian has it.
import { existsSync } from 'node:fs';
import { chromium } from 'playwright-core';

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
];

export const launch = (flags = FLAGS) =>
  chromium.launch({ executablePath: CHROMIUM, args: ['--no-sandbox', ...flags] });

// A page that keeps the errors that it says on the console.
export async function openPage(browser, url, { width = 1440, height = 900, dark = false } = {}) {
  const context = await browser.newContext({
    viewport: { width, height },
    colorScheme: dark ? 'dark' : 'light',
  });
  const page = await context.newPage();
  page.errors = [];
  page.on('console', (message) => {
    if (message.type() === 'error') page.errors.push(message.text());
  });
  page.on('pageerror', (error) => page.errors.push(String(error.stack ?? error)));
  await page.goto(url);
  return page;
}
