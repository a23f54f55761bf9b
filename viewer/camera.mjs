// The folder `camera` of the page: the worker that finds hands, and MediaPipe Hands, which it loads.
// It is apart, because it is ten times as large as the page; without it the page offers no camera.
import { build } from 'esbuild';
import { chmod, copyFile, mkdir, rm } from 'node:fs/promises';
import { join } from 'node:path';

const FILES = [
  'hands.js',
  'hands.binarypb',
  'hand_landmark_lite.tflite',
  'hands_solution_packed_assets.data',
  'hands_solution_packed_assets_loader.js',
  'hands_solution_simd_wasm_bin.js',
  'hands_solution_simd_wasm_bin.wasm',
];

export async function buildCamera(here, page) {
  const folder = join(page, 'camera');
  await rm(folder, { recursive: true, force: true });
  await mkdir(folder, { recursive: true });
  const from = join(here, 'node_modules', '@mediapipe', 'hands');
  for (const name of FILES) {
    await copyFile(join(from, name), join(folder, name));
    await chmod(join(folder, name), 0o644); // not everybody may read those of the package
  }
  await copyFile(join(here, 'licenses', 'mediapipe.txt'), join(folder, 'LICENSE.txt'));
  await build({
    entryPoints: { finder: join(here, 'src', 'camera', 'finder.js') },
    outdir: folder,
    bundle: true,
    minify: true,
    format: 'iife', // MediaPipe needs a classic worker
    target: ['chrome110', 'firefox110', 'safari16'],
    logLevel: 'warning',
  });
}
