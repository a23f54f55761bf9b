// node build.mjs [FOLDER]: bundles the page into one folder, build/viewer, which `posed view` serves.
import { build } from 'esbuild';
import { copyFile, mkdir, writeFile } from 'node:fs/promises';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { buildCamera } from './camera.mjs';
import { mannequin } from './mannequin/mannequin.mjs';
import { COARSE } from './src/scene/capsule.js';

const here = dirname(fileURLToPath(import.meta.url));
const folder = process.argv[2] ?? join(here, '..', 'build', 'viewer');

await mkdir(folder, { recursive: true });
await build({
  entryPoints: { page: join(here, 'src', 'main.js') },
  outdir: folder,
  bundle: true,
  minify: true,
  format: 'esm',
  target: ['chrome110', 'firefox110', 'safari16'],
  legalComments: 'eof', // the licences of three.js and others stay in the file
  logLevel: 'warning',
});
for (const name of ['index.html', 'icon.svg']) await copyFile(join(here, name), join(folder, name));
await writeFile(join(folder, 'mannequin.vrm'), mannequin());
await writeFile(join(folder, 'mannequin-coarse.vrm'), mannequin(COARSE));
if (!process.argv.includes('--no-camera')) await buildCamera(here, folder);
