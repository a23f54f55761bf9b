// A picture and a video of the scene, as files of the browser.
import { keepFile, nameByTime } from '../link/download.js';

const VIDEO_S = 10;
const RATE_HZ = 30;
const TYPES = ['video/webm;codecs=vp9', 'video/webm'];

export class Capture {
  // say(sentence, tone)
  constructor(world, say) {
    Object.assign(this, { world, say });
  }

  // Resolves to the file's name; empty: there is none.
  async picture() {
    const blob = await this.world.picture();
    const name = blob ? nameByTime('png') : '';
    if (blob) keepFile(blob, name);
    this.say(blob ? `picture: ${name}` : 'the browser made no picture', blob ? 'good' : 'bad');
    return name;
  }

  // Ten seconds, or until it is called again. changed(records) tells whether it goes on.
  video(changed, seconds = VIDEO_S) {
    if (this.recorder) {
      this.recorder.stop();
      return;
    }
    const { MediaRecorder } = globalThis;
    const mimeType = TYPES.find((type) => MediaRecorder?.isTypeSupported(type));
    if (!mimeType) {
      this.say('this browser records no video (WebM)', 'bad');
      return;
    }
    const stream = this.world.canvas.captureStream(RATE_HZ);
    const recorder = new MediaRecorder(stream, { mimeType, videoBitsPerSecond: 6e6 });
    const parts = [];
    const timer = setTimeout(() => recorder.stop(), 1000 * seconds);
    recorder.ondataavailable = ({ data }) => data.size > 0 && parts.push(data);
    recorder.onstop = () => {
      clearTimeout(timer);
      this.recorder = null;
      for (const track of stream.getTracks()) track.stop();
      const name = nameByTime('webm');
      keepFile(new Blob(parts, { type: 'video/webm' }), name);
      this.say(`video: ${name}`, 'good');
      changed(false);
    };
    this.recorder = recorder;
    recorder.start(1000);
    changed(true);
  }
}
