// What the page weighs on the way to the browser. `posed view` compresses what it serves.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, readdirSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { gzipSync } from 'node:zlib';

const viewer = join(dirname(fileURLToPath(import.meta.url)), '..', '..');
const MOST_BYTES = 1.5e6;

test('the page with its mannequin is light', () => {
  const folder = mkdtempSync(join(tmpdir(), 'posed-page-'));
  try {
    execFileSync(process.execPath, [join(viewer, 'build.mjs'), folder, '--no-camera']);
    const files = readdirSync(folder);
    assert.ok(files.includes('page.js') && files.includes('mannequin.vrm'));
    const bytes = files.map((name) => gzipSync(readFileSync(join(folder, name))).length);
    const sum = bytes.reduce((a, b) => a + b);
    assert.ok(sum > 100e3 && sum < MOST_BYTES, `${sum} bytes`);
  } finally {
    rmSync(folder, { recursive: true });
  }
});
