// The files that the checks read, made by the program itself from the demo's clips.
import { execFileSync, spawn } from 'node:child_process';
import { once } from 'node:events';
import { mkdtempSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

export function posed(program, ...words) {
  return execFileSync(program, words, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'] });
}

// Runs `check(folder, clip)` in a folder of its own with the demo's clips; the folder is removed at the end.
export async function withClips(program, check) {
  const folder = mkdtempSync(join(tmpdir(), 'posed_npm_'));
  try {
    posed(program, 'demo', '--prepare', folder);
    const clips = readdirSync(folder).filter((name) => name.endsWith('.bvh')).sort();
    await check(folder, join(folder, clips[0]));
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
  writeFileSync(config, `realtime = false\n[publish]\nendpoint = "tcp://127.0.0.1:*"\n[control]\nendpoint = "tcp://127.0.0.1:*"\n${streams.join('')}`);
  const daemon = spawn(program, ['record', '--config', config, '--out', log, '--seconds', '2'], { stdio: 'ignore' });
  await once(daemon, 'exit');
  return log;
}
