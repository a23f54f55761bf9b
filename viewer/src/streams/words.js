// The state of a stream in a word, a tone for its colour, and a sentence where one helps.
import { QUALITIES } from '../wire/pose.js';

// What the stages do, as their StageType (models/) says, too; of others the name itself.
const STAGES = {
  gate: 'drop false values',
  generate: 'smooth and perform',
  constrain: 'keep fingers apart',
  feet: 'feet stand',
};
export const namedStages = Object.keys(STAGES);
export const stageWords = (name) => STAGES[name] ?? name;

// tone: good, busy, bad, off
const state = (word, tone, sentence = '') => ({ word, tone, sentence });

// stats: posed.v1.StreamStats. What is wrong comes first.
export function stateOf(stats) {
  if (!stats) return state('unknown', 'off', 'no statistics came yet');
  if (stats.refusal) return state('refused', 'bad', stats.refusal);
  if (stats.away && stats.connections === 0) {
    return state('away', 'busy', 'its device is not there yet; posed looks for it');
  }
  if (stats.away) return state('lost', 'bad', 'its device is disconnected; posed looks for it');
  if (stats.state === 'waiting') return state('waiting', 'busy', 'nothing came yet');
  if (stats.state === 'stale') return state('stale', 'busy', 'fell silent: the last pose is shown');
  if (stats.state === 'ended') return state('ended', 'off', 'its source has ended');
  if (stats.state === 'unknown') return state('unknown', 'off', 'posed does not report on it now: what is shown is the last that came');
  if (stats.state !== 'live') return state(stats.state, 'busy');
  const lost = stats.dropped + stats.shed + stats.kernel_dropped;
  const were = lost === 1 ? '1 frame was lost' : `${lost} frames were lost`;
  if (stats.lossy) return state('losing', 'bad', `${were} so far, some in the last 10 s`);
  return state('live', 'good', lost > 0 ? `${were} so far, none recently` : '');
}

// How current a pose is, for people; empty when it is measured.
export function qualityWord(pose) {
  if (pose.quality === 0) return '';
  if (pose.quality === 2 && pose.performed) return 'at rest';
  return QUALITIES[pose.quality] ?? 'of unknown quality';
}

// What the label of a stream's pose means; null without one.
export function labelOf({ pose, labelWords }) {
  if (!pose.label) return null;
  const verb = pose.performed ? 'plays' : 'recognised';
  return { verb, label: labelWords, probability: pose.labelProbability };
}

// What the demo's labels mean, which are those of models/gesture. Of another model nothing is known:
// its labels are left as they are.
const SIGNS = {
  g: 'fist',
  c: 'scissors',
  p: 'open hand',
  1: 'index finger',
  3: 'three fingers',
  4: 'four fingers',
};
export function signWords(label, known) {
  const isDemo = ['g', 'c', 'p'].every((one) => known.includes(one));
  return isDemo && SIGNS[label] ? `${SIGNS[label]} (${label})` : label;
}
