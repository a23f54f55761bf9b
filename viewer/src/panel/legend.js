// What the colours mean: only those that are seen now. First the performers, each in its own.
import { MEANINGS } from '../scene/palette.js';
import { el, write } from './dom.js';

const MOST_NAMES = 6; // of more, colours come twice

const ENTRIES = [
  ['raw', 'raw, as captured'],
  ['contact', 'foot stands'],
  ['predicted', 'predicted'],
  ['held', 'held'],
  ['stale', 'stale'],
  ['no-value', 'no value'],
  ['stopped', 'stopped the robot'],
];
const QUALITY = [null, 'predicted', 'held', 'stale'];

// An avatar of one's own keeps its colours, whatever the pose says.
const showsQuality = ({ avatar }) => !avatar || avatar.isPainted;

function seen(world) {
  const keys = new Set();
  for (const performer of world.performers.values()) {
    const { stream, ghost, shown } = performer;
    if (shown === false || !stream.drawable) continue;
    if (ghost) keys.add('raw');
    if (!stream.isHand && world.options.trails) keys.add('contact');
    if (!showsQuality(performer)) continue;
    const performsAtRest = stream.pose.performed && stream.pose.quality === 2;
    if (QUALITY[stream.pose.quality] && !performsAtRest) keys.add(QUALITY[stream.pose.quality]);
    if (stream.partsWithoutValue()) keys.add('no-value');
    if (stream.isRobot && stream.stats?.robot_stop_joint) keys.add('stopped');
  }
  return keys;
}

// What posed did to the stream, in a word, and in a sentence.
export const DONE = {
  'as captured': 'the motion as the device sent it',
  corrected: 'posed has taken out what cannot be: false values, crossed fingers, sliding feet',
  smoothed: 'posed has taken the trembling out of the motion',
  styled: 'posed has put a style on the motion',
  played: 'posed makes this motion from the name of a gesture',
  robot: 'posed has turned a hand into commands for a robot',
  recorded: 'a take of the recordings, played beside the live ones',
};

function done({ stats, pose, isTake }) {
  // A style stage without a style does nothing.
  const working = stats?.stage.filter(({ name, model }) => name !== 'style' || model);
  const names = new Set(working?.map(({ name }) => name));
  if (names.has('style')) return 'styled';
  if (pose.performed) return 'played';
  if (names.has('robot')) return 'robot';
  if (names.has('generate')) return 'smoothed';
  if (isTake) return 'recorded';
  return names.size > 0 ? 'corrected' : 'as captured';
}

function performersOf(world) {
  const mains = world.store
    .shown()
    .map(({ name }) => world.performers.get(name))
    .filter((one) => one && one.shown !== false && one.stream.drawable);
  if (mains.length > MOST_NAMES) return [];
  return mains.map(({ stream, colour }) => ({
    text: `${stream.name}: ${done(stream)}`,
    title: DONE[done(stream)],
    colour,
  }));
}

// An element that begins with the colour of its key, as the scene has it.
export function swatch(name, key, text, colour = MEANINGS[key]) {
  const element = el(`${name}.swatch`, { data: { key } }, text);
  if (colour) element.style.setProperty('--own', colour);
  return element;
}

// Returns the function that keeps `list` right.
export function legend(list) {
  const items = new Map(
    ENTRIES.map(([key, text]) => [key, swatch('li', key, text)]),
  );
  list.append(...items.values());
  const own = [];
  const grow = () => {
    const item = swatch('li', 'performer', '');
    own.push(item);
    items.get('raw').before(item);
    return item;
  };
  return (world) => {
    const keys = seen(world);
    for (const [key, item] of items) item.hidden = !keys.has(key);
    const performers = performersOf(world);
    performers.forEach(({ text, title, colour }, i) => {
      const item = own[i] ?? grow();
      item.style.setProperty('--own', colour);
      write(item, text);
      item.title = title;
    });
    own.forEach((item, i) => {
      item.hidden = i >= performers.length;
    });
  };
}
