// The mannequin's bones in the T-pose: offsets from the bone above and radii in metres, facing +Z,
// the left hand at +X. A person of 1.72 m.

const finger = (side, sign, name, bones, [x, z], lengths, radius) => {
  const [first, second, third] = bones.map((bone) => `${side}${name}${bone}`);
  const along = (length) =>
    name === 'Thumb' ? [sign * 0.72 * length, -0.1 * length, 0.68 * length] : [sign * length, 0, 0];
  return {
    bone: first,
    offset: [sign * x, 0, z],
    radius,
    children: [
      {
        bone: second,
        offset: along(lengths[0]),
        radius,
        children: [
          {
            bone: third,
            offset: along(lengths[1]),
            radius: 0.92 * radius,
            tip: along(lengths[2]),
            tipRadius: 0.85 * radius,
          },
        ],
      },
    ],
  };
};

const PHALANGES = ['Proximal', 'Intermediate', 'Distal'];
const hand = (side, sign) => [
  finger(
    side,
    sign,
    'Thumb',
    ['Metacarpal', 'Proximal', 'Distal'],
    [0.022, 0.026],
    [0.042, 0.032, 0.024],
    0.011,
  ),
  finger(side, sign, 'Index', PHALANGES, [0.088, 0.03], [0.04, 0.024, 0.019], 0.0092),
  finger(side, sign, 'Middle', PHALANGES, [0.091, 0.009], [0.044, 0.028, 0.02], 0.0094),
  finger(side, sign, 'Ring', PHALANGES, [0.087, -0.012], [0.04, 0.026, 0.02], 0.0088),
  finger(side, sign, 'Little', PHALANGES, [0.079, -0.031], [0.032, 0.019, 0.017], 0.0078),
];

const arm = (side, sign) => ({
  bone: `${side}Shoulder`,
  offset: [sign * 0.035, 0.14, 0],
  radius: 0.055,
  children: [
    {
      bone: `${side}UpperArm`,
      offset: [sign * 0.135, 0, 0],
      radius: 0.05,
      children: [
        {
          bone: `${side}LowerArm`,
          offset: [sign * 0.27, 0, 0],
          radius: 0.04,
          children: [
            {
              bone: `${side}Hand`,
              offset: [sign * 0.245, 0, 0],
              radius: 0.024,
              children: hand(side, sign),
            },
          ],
        },
      ],
    },
  ],
});

const leg = (side, sign) => ({
  bone: `${side}UpperLeg`,
  offset: [sign * 0.09, -0.05, 0],
  radius: 0.076,
  children: [
    {
      bone: `${side}LowerLeg`,
      offset: [0, -0.41, 0],
      radius: 0.055,
      children: [
        {
          bone: `${side}Foot`,
          offset: [0, -0.4, -0.012],
          radius: 0.04,
          children: [
            {
              bone: `${side}Toes`,
              offset: [0, -0.052, 0.14],
              radius: 0.032,
              tip: [0, -0.004, 0.055],
              tipRadius: 0.026,
            },
          ],
        },
      ],
    },
  ],
});

export const figure = {
  bone: 'hips',
  offset: [0, 0.945, 0],
  radius: 0.116,
  trunk: true,
  children: [
    {
      bone: 'spine',
      offset: [0, 0.11, 0],
      radius: 0.112,
      trunk: true,
      children: [
        {
          bone: 'chest',
          offset: [0, 0.15, 0],
          radius: 0.132,
          trunk: true,
          tip: [0, 0.135, 0],
          tipStart: 0.139,
          tipRadius: 0.12,
          children: [
            {
              bone: 'neck',
              offset: [0, 0.21, 0],
              radius: 0.048,
              children: [
                {
                  bone: 'head',
                  offset: [0, 0.085, 0.01],
                  radius: 0.05,
                  tip: [0, 0.095, 0.02],
                  tipRadius: 0.102,
                  round: true,
                },
              ],
            },
            arm('left', 1),
            arm('right', -1),
          ],
        },
      ],
    },
    leg('left', 1),
    leg('right', -1),
  ],
};
