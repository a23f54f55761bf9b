// The camera and the worker that finds hands in its pictures. prepare() loads the worker, so that it
// is ready when the browser has asked its user; start() opens the camera. stop() ends the camera's
// tracks at once, and forget() the worker too; one that is not used ends by itself.

const WORKER = '/camera/finder.js';
const WIDTH = 640;
const HEIGHT = 480;
const KEPT_MS = 60000; // a worker without a camera: it holds about 100 MB

const WORDS = {
  NotAllowedError: 'the browser may not use the camera: allow it beside the address of this page',
  NotFoundError: 'this computer has no camera',
  NotReadableError: 'another program uses the camera',
  OverconstrainedError: 'this camera is gone: choose another one',
};

export const wordsOf = (error) => WORDS[error?.name] ?? error?.message ?? String(error);

export class Camera {
  #stream = null;
  #worker = null;
  #ready = false;
  #busy = false;
  #wanted = false; // from start() to stop(), also while the browser asks
  #unused = null; // the timer that ends a worker without a camera
  #run = 0; // counts starts and stops: what an earlier one has begun is no more wanted

  // handlers: found({hands, time_ms, picture}), ended(sentence). The picture is found()'s to close.
  constructor(video, handlers) {
    this.video = video;
    this.handlers = handlers;
  }

  // Whether the processor has more to do than to draw.
  get isBusy() {
    return this.running || (this.#worker !== null && !this.#ready);
  }

  get isReady() {
    return this.#ready;
  }

  get running() {
    return this.#stream !== null;
  }

  async start(deviceId) {
    this.stop();
    const run = this.#run;
    this.#wanted = true;
    clearTimeout(this.#unused);
    this.prepare();
    const stream = await navigator.mediaDevices.getUserMedia({
      audio: false,
      video: {
        width: { ideal: WIDTH },
        height: { ideal: HEIGHT },
        ...(deviceId ? { deviceId: { exact: deviceId } } : {}),
      },
    });
    if (run !== this.#run) return end(stream);
    this.#stream = stream;
    stream.getVideoTracks()[0].onended = () => this.#end('the camera is gone');
    this.video.srcObject = stream;
    await this.video.play();
    this.#next(run);
    return undefined;
  }

  stop() {
    this.#run += 1;
    this.#wanted = false;
    if (this.#stream) end(this.#stream);
    this.#stream = null;
    this.video.srcObject = null;
    this.#endUnused();
  }

  forget() {
    this.stop();
    clearTimeout(this.#unused);
    this.#worker?.terminate();
    this.#worker = null;
    this.#ready = false;
    this.#busy = false;
  }

  prepare() {
    if (!this.#worker) this.#load();
    if (!this.#wanted) this.#endUnused();
  }

  #endUnused() {
    clearTimeout(this.#unused);
    this.#unused = setTimeout(() => this.forget(), KEPT_MS);
  }

  #end(sentence) {
    const wanted = this.#wanted; // who only looked at the button hears nothing
    this.forget();
    if (wanted) this.handlers.ended(sentence);
  }

  #load() {
    const worker = new Worker(WORKER);
    worker.onerror = () => {
      if (worker === this.#worker) this.#end('what finds hands cannot be loaded');
    };
    worker.onmessage = ({ data }) => {
      if (worker !== this.#worker) return;
      this.#busy = false;
      if (data.error) this.#end(`no hands can be found: ${data.error}`);
      else if (data.ready) this.#ready = true;
      else if (data.run === this.#run) this.handlers.found(data);
      else data.picture.close();
    };
    this.#worker = worker;
  }

  // One picture after the other: a slow computer gets fewer of them, none waits.
  #next(run) {
    if (run !== this.#run) return;
    const { video } = this;
    const seen = (now_ms, about) => {
      this.#send(run, about?.captureTime ?? now_ms);
      this.#next(run);
    };
    if (video.requestVideoFrameCallback) video.requestVideoFrameCallback(seen);
    else setTimeout(() => seen(performance.now()), 33);
  }

  async #send(run, time_ms) {
    if (!this.#ready || this.#busy || this.video.readyState < 2) return;
    this.#busy = true;
    try {
      const picture = await createImageBitmap(this.video);
      if (run === this.#run) {
        this.#worker.postMessage({ picture, time_ms, run }, [picture]);
        return;
      }
      picture.close();
    } catch {
      // There is no picture yet.
    }
    this.#busy = false;
  }
}

function end(stream) {
  for (const track of stream.getTracks()) {
    track.onended = null;
    track.stop();
  }
}

export async function cameras() {
  const devices = (await navigator.mediaDevices?.enumerateDevices()) ?? [];
  return devices.filter(({ kind, deviceId }) => kind === 'videoinput' && deviceId !== '');
}
