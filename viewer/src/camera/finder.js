// The worker that finds hands in pictures, with MediaPipe Hands on the processor. A classic worker:
// MediaPipe loads its parts with importScripts or, as here, as the scripts of a page. The page's
// way is the one that works (in a worker's way it loads its model as a script), so this gives it
// what it needs of a page.
//
// From the page: {picture: ImageBitmap, time_ms, run}. To it: {ready}, {picture, time_ms, run,
// hands}, {error}.
import { handsOf } from './hands_of.js';

const FOLDER = '/camera/';

class Script extends EventTarget {
  setAttribute(name, value) {
    this[name] = value;
  }
}

self.window = self;
self.document = {
  createElement: (name) => (name === 'canvas' ? new OffscreenCanvas(1, 1) : new Script()),
  addEventListener() {},
  removeEventListener() {},
  body: {
    appendChild(script) {
      self.importScripts(script.src);
      script.dispatchEvent(new Event('load'));
    },
  },
};

const LITE = 0;
const WIDTH = 640;
const HEIGHT = 480;
let results = null;

async function start() {
  self.importScripts(`${FOLDER}hands.js`);
  const finder = new self.Hands({ locateFile: (name) => `${FOLDER}${name}` });
  finder.setOptions({
    maxNumHands: 2,
    modelComplexity: LITE,
    minDetectionConfidence: 0.5,
    minTrackingConfidence: 0.5,
    selfieMode: false,
    useCpuInference: true, // without a graphics card its WebGL takes seconds a picture
  });
  finder.onResults((found) => {
    results = found;
  });
  await finder.initialize();
  // The first picture takes as long as twenty others: an empty one is looked through at once.
  const canvas = new OffscreenCanvas(WIDTH, HEIGHT);
  canvas.getContext('2d').fillRect(0, 0, WIDTH, HEIGHT);
  const empty = canvas.transferToImageBitmap();
  await finder.send({ image: empty });
  empty.close();
  results?.image?.close?.();
  return finder;
}

const finder = start();
finder.then(
  () => self.postMessage({ ready: true }),
  (error) => self.postMessage({ error: String(error?.message ?? error) }),
);

self.onmessage = async ({ data: { picture, time_ms, run } }) => {
  try {
    results = null;
    const one = await finder;
    await one.send({ image: picture });
    results?.image?.close?.();
    const hands = handsOf(results, picture.width / picture.height);
    self.postMessage({ picture, time_ms, run, hands }, [picture]);
  } catch (error) {
    self.postMessage({ error: String(error?.message ?? error) });
  }
};
