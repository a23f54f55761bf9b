// A figure that waves every joint, those of the fingers, too, as BVH: a clip that posed did not make.
import { writeFileSync } from 'node:fs';

const FRAMES = 120;
const RATE_HZ = 60;

// Joints with their offsets [cm] and children. Names are those of VRM, with a capital.
const leg = (side, x) => [
  `${side}UpperLeg`, [x, -4, 0], [[`${side}LowerLeg`, [0, -42, 0], [[`${side}Foot`, [0, -41, 0], [], [0, -4, 12]]]]],
];
const finger = (side, sign, name, bones, z) => {
  const [first, second, third] = bones.map((bone) => `${side}${name}${bone}`);
  const reach = (x) => [sign * x, 0, 0];
  return [first, [sign * 8, 0, z], [[second, reach(4), [[third, reach(3), [], reach(2)]]]]];
};
const fingers = (side, sign) => [
  finger(side, sign, 'Thumb', ['Metacarpal', 'Proximal', 'Distal'], 4),
  ...['Index', 'Middle', 'Ring', 'Little'].map((name, i) =>
    finger(side, sign, name, ['Proximal', 'Intermediate', 'Distal'], 3 - 2 * i)),
];
const arm = (side, sign) => [
  `${side}Shoulder`, [sign * 3, 10, 0], [[`${side}UpperArm`, [sign * 12, 0, 0], [
    [`${side}LowerArm`, [sign * 28, 0, 0], [[`${side}Hand`, [sign * 25, 0, 0], fingers(side, sign)]]],
  ]]],
];
const figure = [
  'Hips', [0, 93, 0], [
    ['Spine', [0, 12, 0], [['Chest', [0, 16, 0], [
      ['Neck', [0, 18, 0], [['Head', [0, 8, 0], [], [0, 18, 0]]]],
      arm('Left', 1),
      arm('Right', -1),
    ]]]],
    leg('Left', 9),
    leg('Right', -9),
  ],
];

function hierarchy([name, offset, children, end], depth = 0) {
  const head = depth === 0 ? 'ROOT' : 'JOINT';
  const position = depth === 0 ? '6 Xposition Yposition Zposition' : '3';
  const tip = end ? `End Site\n{\nOFFSET ${end.join(' ')}\n}\n` : '';
  const below = children.map((child) => hierarchy(child, depth + 1)).join('');
  return `${head} ${name}\n{\nOFFSET ${offset.join(' ')}\nCHANNELS ${position} Zrotation Xrotation Yrotation\n${below}${tip}}\n`;
}

const count = ([, , children]) => 1 + children.reduce((sum, child) => sum + count(child), 0);

export function writeWalk(path) {
  const angles = 3 * count(figure);
  const lines = Array.from({ length: FRAMES }, (_, i) => {
    const row = [Math.sin(i / 20), 93 + Math.cos(i / 5), i];
    for (let c = 0; c < angles; c += 1) row.push(25 * Math.sin(i / 12 + c) + (c % 7));
    return row.map((value) => value.toFixed(6)).join(' ');
  });
  writeFileSync(path, `HIERARCHY\n${hierarchy(figure)}MOTION\nFrames: ${FRAMES}\nFrame Time: ${1 / RATE_HZ}\n${lines.join('\n')}\n`);
}
