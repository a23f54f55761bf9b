// What the colours mean: only those that are seen now.
import { el } from './dom.js';

const ENTRIES = [
  ['styled', 'styled by posed'],
  ['shown', 'published by posed'],
  ['raw', 'raw, as captured'],
  ['contact', 'foot stands'],
  ['predicted', 'predicted'],
  ['held', 'held'],
  ['stale', 'stale'],
  ['no-value', 'no value'],
];
const QUALITY = [null, 'predicted', 'held', 'stale'];

function seen(world) {
  const keys = new Set();
  for (const { stream, ghost, shown } of world.performers.values()) {
    if (shown === false || !stream.drawable) continue;
    if (ghost) keys.add('raw');
    else keys.add(stream.stage('style') ? 'styled' : 'shown');
    if (!stream.isHand && world.options.trails) keys.add('contact');
    const performsAtRest = stream.pose.performed && stream.pose.quality === 2;
    if (QUALITY[stream.pose.quality] && !performsAtRest) keys.add(QUALITY[stream.pose.quality]);
    if (stream.partsWithoutValue()) keys.add('no-value');
  }
  if (keys.has('styled')) keys.delete('shown');
  return keys;
}

// Returns the function that keeps `list` right.
export function legend(list) {
  const items = new Map(
    ENTRIES.map(([key, text]) => [key, el('li', { data: { key }, hidden: true }, text)]),
  );
  list.append(...items.values());
  return (world) => {
    const keys = seen(world);
    for (const [key, item] of items) item.hidden = !keys.has(key);
  };
}
