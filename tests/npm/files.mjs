// The files that the checks read.
import { execFileSync, spawn } from 'node:child_process';
import { once } from 'node:events';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

import { writeWalk } from './walk.mjs';

export function posed(program, ...words) {
  return execFileSync(program, words, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'] });
}

// Runs `check(folder, clip)` with a clip in a folder of its own, which is removed at the end.
export async function withClip(check) {
  const folder = mkdtempSync(join(tmpdir(), 'posed_npm_'));
  try {
    const clip = join(folder, 'walk.bvh');
    writeWalk(clip);
    await check(folder, clip);
  } finally {
    rmSync(folder, { recursive: true, force: true });
  }
}

// Records the clip, played once as fast as possible, as the streams "walker" and "plain".
export async function record(program, folder, clip) {
  const streams = ['walker', 'plain'].map((name) => `[[stream]]
name = "${name}"
driver = "file"
[stream.file]
path = "${clip}"
loop = false
pace = 0.0
`);
  const config = join(folder, 'take.toml');
  const log = join(folder, 'take.plog');
  const endpoint = 'endpoint = "tcp://127.0.0.1:*"';
  const text = `realtime = false\n[publish]\n${endpoint}\n[control]\n${endpoint}\n${streams.join('')}`;
  writeFileSync(config, text);
  const daemon = spawn(program, ['record', '--config', config, '--out', log, '--seconds', '2'], {
    stdio: ['ignore', 'ignore', 'pipe'],
  });
  let errors = '';
  daemon.stderr.on('data', (text) => { errors += text; });
  const [code] = await once(daemon, 'close');
  if (code !== 0) throw new Error(`posed record: ${errors}`);
  return log;
}
