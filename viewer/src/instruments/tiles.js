// The figures of the chosen stream. One that it does not have is not shown.
import { el, write } from '../panel/dom.js';
import { isSlow, ms, signed } from '../panel/numbers.js';
import { ROBOT_TILES } from './robot_tiles.js';

const count = (number) => number.toLocaleString('en');

// Each: name, explanation, text of {stream, history, fps}; empty text: not shown.
export const TILES = [
  [
    'Rate',
    'frames that posed published in the last second',
    ({ stats }) => `${stats.rate_hz.toFixed(1)} Hz`,
  ],
  [
    'Time in posed',
    'from arrival to handed out: half of the last second’s frames took at most this; 99 % that',
    ({ stats }) =>
      stats.publish?.p99_us > 0
        ? `${ms(stats.publish.p50_us / 1000)} (99 % within ${ms(stats.publish.p99_us / 1000)})`
        : '',
  ],
  [
    'Delay to this page',
    'half of the poses of the last 3 s took at most this from their arrival at posed to this page',
    ({ history }) => ms(history.callback_ms),
  ],
  [
    'Delay until drawn',
    'from arrival at posed until drawn here: half of the poses of the last 3 s took at most this',
    ({ history }) => `${ms(history.picture_ms)}${isSlow(history.picture_ms) ? ': this page is slow' : ''}`,
  ],
  [
    'Lag',
    'the smoother waits for newer frames',
    ({ stats }) =>
      stats.lag_frames > 0
        ? `${stats.lag_frames} frame${stats.lag_frames === 1 ? '' : 's'}, ${ms(stats.lag_ms)}`
        : '',
  ],
  ['Jitter', 'how unevenly frames arrive', ({ stream }) => ms(stream.jitter.ms)],
  [
    'Dropped, queue full',
    'frames for which posed had no room',
    ({ stats }) => count(stats.dropped),
  ],
  [
    'Skipped for newer',
    'frames that waited until a newer one had come',
    ({ stats }) => count(stats.shed),
  ],
  [
    'Lost in the kernel',
    'datagrams that were not read in time',
    ({ stats }) => (stats.kernel_dropped > 0 ? count(stats.kernel_dropped) : ''),
  ],
  [
    'False values',
    'of the joint of which the gate drops most, the share of the last ten seconds that it dropped',
    ({ stats }) =>
      stats.gate_dropped >= 0.001
        ? `${stats.gate_joint}: ${(100 * stats.gate_dropped).toFixed(1)} %`
        : '',
  ],
  ...ROBOT_TILES,
  [
    'Clock drift',
    'how much faster the device’s clock goes than this computer’s, in millionths',
    ({ stats }) =>
      stats.clock_offset_ns === undefined
        ? ''
        : `${signed(stats.clock_drift_ppm, 1)} ppm`,
  ],
  [
    'Connected',
    'how often the device connected',
    ({ stats }) => (stats.connections > 1 ? `${stats.connections} times` : ''),
  ],
  [
    'This page',
    'pictures per second on this screen',
    ({ fps }) => (fps > 0 ? `${fps.toFixed(0)} fps` : ''),
  ],
];

export class Tiles {
  constructor() {
    this.tiles = TILES.map(([name, title, text]) => {
      const value = el('dd');
      const element = el('div.tile', { title, hidden: true }, el('dt', {}, name), value);
      return { element, value, text };
    });
    this.element = el('dl.tiles', {}, ...this.tiles.map(({ element }) => element));
  }

  update(stream, history, fps) {
    const { stats } = stream;
    for (const { element, value, text } of this.tiles) {
      const words = stats ? text({ stream, stats, history, fps }) : '';
      element.hidden = words === '';
      write(value, words);
    }
  }
}
