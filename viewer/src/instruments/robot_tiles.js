// What stopped a robot, in numbers.
const count = (number) => number.toLocaleString('en');

const since = (value) => (value > 0 ? count(value) : '');

export const ROBOT_TILES = [
  [
    'Robot stopped',
    'how often it stood because links were in the way; hard: at once, so that they did not meet',
    ({ stats }) =>
      stats.robot_stops === undefined
        ? ''
        : `${count(stats.robot_stops)}, ${count(stats.robot_hard_stops)} hard`,
  ],
  [
    'Stopped by',
    'the links that were in the way just now; they are red',
    ({ stats }) =>
      stats.robot_stop_joint ? `${stats.robot_stop_joint}, ${stats.robot_stop_other}` : '',
  ],
  [
    'Robot limited',
    'commands that links in the way changed',
    ({ stats }) => since(stats.robot_limited),
  ],
  [
    'Robot held',
    'how often it braked because the hand could not be trusted',
    ({ stats }) => since(stats.robot_holds),
  ],
];
