// The words above each figure: its name, what it is (raw or styled, and how much), and how current.
import { labelOf, qualityWord, stateOf } from '../streams/words.js';
import { RAW_SUFFIX } from '../streams/stream.js';
import { percent, signed } from './numbers.js';

const KNOWN = 0.5; // below it the style is mostly faded

function styledWords(stream) {
  const alpha = stream.parameter('style', 'alpha');
  if (!alpha || !stream.stage('style').model) return '';
  const faded = alpha.value !== 0 && stream.stats.style_gate < KNOWN;
  return `styled, amount ${signed(alpha.value, 2)}${faded ? '\u00a0· fades: the model does not know this motion' : ''}`;
}

// A line may end before the label and behind it.
function labelWords({ verb, label, probability }) {
  const words = label.replaceAll(' ', '\u00a0');
  return verb === 'plays' ? `plays ${words}` : `recognised ${words}, ${percent(probability)} sure`;
}

function words(stream, main) {
  if (stream.isTake) return 'recorded';
  const parts = [];
  if (stream.isRaw) parts.push('raw, as captured');
  else if (styledWords(stream)) parts.push(styledWords(stream));
  const { word, tone } = stateOf(main?.stats);
  if (tone !== 'good') parts.push(word);
  const label = stream.isRaw ? null : labelOf(stream);
  if (label) parts.push(labelWords(label));
  const quality = qualityWord(stream.pose);
  if (quality && quality !== word) parts.push(quality);
  const missing = stream.partsWithoutValue();
  if (missing) parts.push(`no value: ${missing}`);
  return parts.join('\u00a0· '); // a line may end after the dot
}

export function writeTags(world, chosenName) {
  for (const { stream, ghost, colour } of world.performers.values()) {
    const base = ghost ? stream.name.slice(0, -RAW_SUFFIX.length) : stream.name;
    const main = world.store.streams.get(base);
    world.tags.write(stream.name, {
      title: base,
      detail: words(stream, main),
      kind: ghost ? 'raw' : 'styled',
      chosen: base === chosenName,
      colour,
    });
  }
}
