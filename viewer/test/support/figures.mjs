// Skeletons and motions that the fake bridge plays: a walker, the same walker styled, a hand.
const D = Math.PI / 180;

// A body: [bone, parent's index, offset m, tip m or null]. Facing +Z; all zero rotations: T-pose.
const leg = (side, x, hips, at) => [
  [`${side}UpperLeg`, hips, [x, -0.04, 0]],
  [`${side}LowerLeg`, at, [0, -0.42, 0]],
  [`${side}Foot`, at + 1, [0, -0.41, 0]],
  [`${side}Toes`, at + 2, [0, -0.045, 0.13], [0, 0, 0.06]],
];
const arm = (side, sign, chest, at) => [
  [`${side}Shoulder`, chest, [sign * 0.04, 0.17, 0]],
  [`${side}UpperArm`, at, [sign * 0.13, 0, 0]],
  [`${side}LowerArm`, at + 1, [sign * 0.27, 0, 0]],
  [`${side}Hand`, at + 2, [sign * 0.24, 0, 0], [sign * 0.09, 0, 0]],
];
const BODY = [
  ['hips', -1, [0, 0.93, 0]],
  ['spine', 0, [0, 0.12, 0]],
  ['chest', 1, [0, 0.15, 0]],
  ['neck', 2, [0, 0.23, 0]],
  ['head', 3, [0, 0.09, 0], [0, 0.17, 0]],
  ...arm('left', 1, 2, 5),
  ...arm('right', -1, 2, 9),
  ...leg('left', 0.09, 0, 13),
  ...leg('right', -0.09, 0, 17),
];

const PHALANGES = ['Proximal', 'Intermediate', 'Distal'];
const HAND = [['rightHand', -1, [0, 0, 0]]];
for (const [name, x, z, lengths] of [
  ['Thumb', 0.028, 0.03, [0.045, 0.034, 0.026]],
  ['Index', 0.027, 0.09, [0.042, 0.025, 0.02]],
  ['Middle', 0.006, 0.093, [0.046, 0.029, 0.021]],
  ['Ring', -0.014, 0.088, [0.042, 0.027, 0.021]],
  ['Little', -0.034, 0.08, [0.033, 0.02, 0.018]],
]) {
  const along = (length) => (name === 'Thumb' ? [0.6 * length, 0, 0.8 * length] : [0, 0, length]);
  const first = HAND.length;
  const bones = name === 'Thumb' ? ['Metacarpal', 'Proximal', 'Distal'] : PHALANGES;
  bones.forEach((bone, i) =>
    HAND.push([
      `right${name}${bone}`,
      i === 0 ? 0 : first + i - 1,
      i === 0 ? [x, 0, z] : along(lengths[i - 1]),
      i === 2 ? along(lengths[2]) : null,
    ]),
  );
}

function skeleton(joints, { stream, id, rate_hz, stage }) {
  return {
    stream,
    id,
    name: 'of the fake bridge',
    rate_hz,
    stage,
    root_joint: 0,
    joint_name: joints.map(([bone]) => bone),
    humanoid_bone: joints.map(([bone]) => bone),
    parent: joints.map(([, parent]) => parent),
    offset_m: joints.flatMap(([, , offset]) => offset),
    T_world_joint_xyzw: joints.flatMap(() => [0, 0, 0, 1]),
    end_site_m: joints.flatMap(([, , , tip]) => tip ?? [NaN, NaN, NaN]),
  };
}

export const bodySkeleton = (options) => skeleton(BODY, options);
export const handSkeleton = (options) => skeleton(HAND, options);

const about = (axis, angle) => {
  const q = [0, 0, 0, Math.cos(angle / 2)];
  q['xyz'.indexOf(axis)] = Math.sin(angle / 2);
  return q;
};
const times = ([ax, ay, az, aw], [bx, by, bz, bw]) => [
  aw * bx + ax * bw + ay * bz - az * by,
  aw * by - ax * bz + ay * bw + az * bx,
  aw * bz + ax * by - ay * bx + az * bw,
  aw * bw - ax * bx - ay * by - az * bz,
];

const CYCLES_PER_S = 0.95;
const STANCE = 0.6; // share of the cycle in which a foot stands
const REACH = 27 * D; // of the leg, to the front and to the back

// A leg at a share of its cycle: while its foot stands it turns back evenly, so that the foot stays
// where it is; then it swings forward with a bent knee.
function stride(share) {
  if (share < STANCE) return { hip: REACH * (1 - (2 * share) / STANCE), knee: 4 * D, stands: true };
  const swing = (share - STANCE) / (1 - STANCE);
  return {
    hip: -REACH * Math.cos(Math.PI * swing),
    knee: (4 + 52 * Math.sin(Math.PI * swing)) * D,
    stands: false,
  };
}

// A walk straight ahead, from z = -4 m on; style 0 to 1 lets the hips sway and the arms hang wider.
export function walk(time_s, style) {
  const cycle = CYCLES_PER_S * time_s;
  const phase = 2 * Math.PI * cycle;
  const swing = Math.cos(phase);
  const turns = {
    hips: times(about('z', style * 7 * D * Math.sin(phase)), about('y', -7 * D * swing)),
    spine: about('z', -style * 10 * D * Math.sin(phase)),
    chest: times(about('y', 13 * D * swing), about('x', (4 - 8 * style) * D)),
    head: times(about('y', -5 * D * swing), about('x', (2 + 4 * style) * D)),
  };
  let height_m = 0;
  for (const [side, sign, ahead] of [
    ['left', 1, 0],
    ['right', -1, 0.5],
  ]) {
    const { hip, knee, stands } = stride((cycle + ahead) % 1);
    turns[`${side}UpperLeg`] = about('x', -hip - 0.3 * knee);
    turns[`${side}LowerLeg`] = about('x', knee);
    turns[`${side}Foot`] = about('x', hip - 0.7 * knee + (stands ? 0 : 10 * D));
    turns[`${side}UpperArm`] = times(
      about('x', sign * 22 * swing * (1 - 0.4 * style) * D),
      about('z', -sign * (78 - 16 * style) * D),
    );
    turns[`${side}LowerArm`] = about('y', -sign * (20 + 26 * style) * D);
    if (stands) height_m = Math.max(height_m, 0.04 + 0.83 * Math.cos(hip) + 0.075);
  }
  const speed = (2 * 0.83 * Math.sin(REACH) * CYCLES_PER_S) / STANCE;
  return {
    root_position_m: [style * 0.025 * Math.sin(phase), height_m, ((speed * time_s) % 8) - 4],
    rotation_xyzw: BODY.flatMap(([bone]) => turns[bone] ?? [0, 0, 0, 1]),
  };
}

// How far each finger is bent, 0 to 1, thumb to little, in a few signs.
export const SIGNS = {
  g: [0.3, 0, 1, 1, 1],
  1: [0.8, 0, 1, 1, 1],
  c: [0.4, 0.5, 0.5, 0.5, 0.5],
  3: [0, 0, 0, 1, 1],
  4: [0.9, 0, 0, 0, 0],
  p: [0.1, 0.1, 0.6, 1, 1],
};

export function hold(sign, waver) {
  const bends = SIGNS[sign] ?? [0.1, 0.1, 0.1, 0.1, 0.1];
  const rotation_xyzw = HAND.flatMap((_, joint) => {
    if (joint === 0) return [0, 0, 0, 1];
    const bend = bends[Math.floor((joint - 1) / 3)] + 0.03 * waver;
    return joint < 4 ? about('y', -50 * D * bend) : about('x', 78 * D * bend);
  });
  return { root_position_m: [0, 0, 0], rotation_xyzw };
}

// The walk as a BVH in centimetres, as posed writes a take.
export function walkBvh(frames, rate_hz) {
  const lines = [];
  const write = (joint) => {
    const [name, above, offset_m, tip_m] = BODY[joint];
    const at = (offset) => `OFFSET ${offset.map((value) => 100 * value).join(' ')}`;
    const turns = 'Zrotation Yrotation Xrotation';
    lines.push(`${above < 0 ? 'ROOT' : 'JOINT'} ${name}`, '{', at(offset_m));
    if (above < 0) lines.push(`CHANNELS 6 Xposition Yposition Zposition ${turns}`);
    else lines.push(`CHANNELS 3 ${turns}`);
    BODY.forEach(([, parent], child) => parent === joint && write(child));
    if (tip_m) lines.push('End Site', '{', at(tip_m), '}');
    lines.push('}');
  };
  lines.push('HIERARCHY');
  write(0);
  lines.push('MOTION', `Frames: ${frames}`, `Frame Time: ${1 / rate_hz}`);
  for (let i = 0; i < frames; i += 1) {
    const { rotation_xyzw: all, root_position_m: root_m } = walk(i / rate_hz, 0);
    const row = Array.from(root_m, (value) => 100 * value);
    for (const joint of writtenOrder(0)) {
      const [x, y, z, w] = all.slice(4 * joint, 4 * joint + 4);
      row.push(
        Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)) / D,
        Math.asin(2 * (w * y - z * x)) / D,
        Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)) / D,
      );
    }
    lines.push(row.map((value) => value.toFixed(6)).join(' '));
  }
  return `${lines.join('\n')}\n`;
}

// Depth first, as a BVH has its joints.
function writtenOrder(joint) {
  const children = BODY.flatMap(([, parent], child) => (parent === joint ? [child] : []));
  return [joint, ...children.flatMap(writtenOrder)];
}
