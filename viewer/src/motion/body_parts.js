// The parts of a body that people name, as the style's mask does: by VRM's bones.

export const PARTS = ['trunk', 'head', 'left arm', 'right arm', 'left leg', 'right leg'];
export const MASK_WORDS = ['trunk', 'head', 'left-arm', 'right-arm', 'left-leg', 'right-leg'];

const LEG = /Leg|Foot|Toes/;
const HEAD = /^(neck|head|jaw|leftEye|rightEye)$/;

function partOfBone(bone) {
  if (HEAD.test(bone)) return 1;
  const left = bone.startsWith('left');
  if (!left && !bone.startsWith('right')) return 0;
  if (LEG.test(bone)) return left ? 4 : 5;
  return left ? 2 : 3;
}

// The part of each joint; a joint that is no bone belongs to the next bone above it.
export function partsOf({ bones, parent }) {
  const parts = new Uint8Array(bones.length);
  bones.forEach((bone, joint) => {
    if (bone) parts[joint] = partOfBone(bone);
    else parts[joint] = parent[joint] >= 0 ? parts[parent[joint]] : 0;
  });
  return parts;
}

const FINGER = /(Thumb|Index|Middle|Ring|Little)/;

// The fingers of a lone hand are its parts: 'thumb' to 'little'; others: as above.
export function partWords(kinematics) {
  const parts = partsOf(kinematics);
  return kinematics.bones.map(
    (bone, joint) => FINGER.exec(bone)?.[1].toLowerCase() ?? PARTS[parts[joint]],
  );
}

// A hand alone: it has fingers, but no hips.
export function isHand({ bones }) {
  return !bones.includes('hips') && bones.some((bone) => FINGER.test(bone));
}

// "arms=0.5,head=0" as six factors, in the order of PARTS; a part that is not named has 1.
export function parseMask(text) {
  const factors = [1, 1, 1, 1, 1, 1];
  for (const piece of text.split(',')) {
    const [name, number] = piece.split('=').map((word) => word.trim());
    const factor = Number(number);
    MASK_WORDS.forEach((word, i) => {
      if (
        Number.isFinite(factor) &&
        (word === name || word.endsWith(`-${name?.replace(/s$/, '')}`))
      ) {
        factors[i] = factor;
      }
    });
  }
  return factors;
}

// Only parts that differ from 1; equal sides together. Empty: the whole body.
export function maskText(factors) {
  const pieces = [];
  const add = (word, factor) => {
    if (factor !== 1) pieces.push(`${word}=${Number(factor.toFixed(2))}`);
  };
  add('trunk', factors[0]);
  add('head', factors[1]);
  for (const [word, left] of [
    ['arm', 2],
    ['leg', 4],
  ]) {
    if (factors[left] === factors[left + 1]) {
      add(`${word}s`, factors[left]);
    } else {
      add(`left-${word}`, factors[left]);
      add(`right-${word}`, factors[left + 1]);
    }
  }
  return pieces.join(',');
}
