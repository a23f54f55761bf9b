// node main.mjs POSED: the files that `posed convert` writes, opened by the libraries that their users have.
import { checkMcap } from './mcap.mjs';
import { checkVrma } from './vrma.mjs';
import { withClip } from './files.mjs';

const [program] = process.argv.slice(2);
await withClip(async (folder, clip) => {
  const skeleton = await checkMcap(program, folder, clip);
  await checkVrma(program, folder, clip, skeleton);
});
