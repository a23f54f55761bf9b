// Colours of the scene, light and dark. Those that carry a meaning are of Okabe and Ito's palette,
// which people with any usual colour blindness can tell apart; each comes with a word as well.
import { Color } from 'three';

const colour = (hex) => new Color(hex);

const THEMES = {
  light: {
    background: colour('#eef1f4'),
    ground: colour('#eef1f4'),
    line: colour('#c3cad2'),
    strong: colour('#98a3af'),
    performers: ['#2f7fc1', '#b08d00', '#7a5bd0', '#12929c', '#8a5a34', '#4d5b8c'].map(colour),
    raw: colour('#7d8793'),
    rawOpacity: 0.42,
    sky: colour('#ffffff'),
    below: colour('#c9ced6'),
    sun: 2.1,
    ambient: 1.55,
    shadow: 0.24,
    hands: colour('#f8f9fb'),
  },
  dark: {
    background: colour('#11151a'),
    ground: colour('#11151a'),
    line: colour('#2b333c'),
    strong: colour('#46525e'),
    performers: ['#58b0ea', '#e0c33c', '#a990f5', '#3fc4cd', '#c08a5a', '#93a4e0'].map(colour),
    raw: colour('#b4bdc8'),
    rawOpacity: 0.55,
    sky: colour('#dfe9f5'),
    below: colour('#20262d'),
    sun: 1.9,
    ambient: 1.05,
    shadow: 0.5,
    hands: colour('#171c22'),
  },
};

// Of those that carry a meaning, by the legend's keys.
export const MEANINGS = {
  contact: '#009e73',
  predicted: '#e69f00',
  held: '#cc79a7',
  stale: '#8f969e',
  'no-value': '#d55e00',
  stopped: '#d1242f', // links of a robot; the instruments name them
};
// By Quality; measured has the figure's own colour.
const QUALITY = [null, ...['predicted', 'held', 'stale'].map((key) => colour(MEANINGS[key]))];
const NO_VALUE = colour(MEANINGS['no-value']);
const CONTACT = colour(MEANINGS.contact);
const STOPPED = colour(MEANINGS.stopped);

// Of one colour, in bodies' and hands' view: plain, or to be cut out by a video mixer.
const SINGLE = { plain: colour('#9aa0a6'), green: colour('#00b140') };

// The colours of the page's theme, or of what was chosen in its place for the scene.
export function sceneColours(theme, background) {
  const single = SINGLE[background];
  const colours = THEMES[background] ?? THEMES[theme];
  // What is to be cut out must not shine through anybody.
  const rawOpacity = background === 'green' ? 1 : colours.rawOpacity;
  return single ? { ...colours, background: single, hands: single, rawOpacity } : colours;
}

// Performers have a colour each, in their order; a seventh has that of the first again.
export const performerColour = ({ performers }, number) => performers[number % performers.length];

// The colour of a joint: without a value, or as current as the pose is.
export function jointColour(own, quality, hasValue, performedAtRest) {
  if (!hasValue) return NO_VALUE;
  if (performedAtRest) return own;
  return QUALITY[quality] ?? own;
}

export { CONTACT, STOPPED };
