// A capsule with two radii as flat arrays, for the limbs of figures and of the mannequin.

// How finely a capsule is cut: vertices of a ring, rings of each rounded end. Where the processor
// draws, its time goes into vertices: the coarse one has a third of them.
export const FINE = { around: 14, arc: 4 };
export const COARSE = { around: 9, arc: 2 };

// A mesh that grows: positions, normals, what each vertex belongs to, triangles.
export class Mesh {
  position = [];
  normal = [];
  owner = []; // joint of each vertex
  index = [];

  constructor(detail = FINE) {
    this.detail = detail;
  }
}

const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
const unit = (v) => {
  const length = Math.hypot(...v) || 1;
  return v.map((value) => value / length);
};

// Three directions at right angles: along the axis, and across; `front` is kept across.
function directions(from, to) {
  const along = Math.hypot(...subtract(to, from)) > 1e-6 ? unit(subtract(to, from)) : [0, 1, 0];
  const side = Math.abs(along[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0];
  const front = unit(
    subtract(
      side,
      along.map((value) => value * dot(side, along)),
    ),
  );
  return { along, front, across: cross(along, front) };
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

// The rings from one end to the other: {centre along the axis, radius, slope of the normal}.
function rings(length, start_m, end_m, arc) {
  const list = [];
  const quarter = Math.PI / 2;
  for (let i = 0; i <= arc; i += 1) {
    const angle = -quarter + (quarter * i) / arc;
    list.push({ at: start_m * Math.sin(angle), radius: start_m * Math.cos(angle), slope: angle });
  }
  for (let i = 0; i <= arc; i += 1) {
    const angle = (quarter * i) / arc;
    list.push({
      at: length + end_m * Math.sin(angle),
      radius: end_m * Math.cos(angle),
      slope: angle,
    });
  }
  return list;
}

// Adds the capsule from `from` to `to` with the radii at its ends. flat: factor on its depth
// (along the figure's front), below 1 for a trunk.
export function addCapsule(mesh, from, to, start_m, end_m, owner, flat = 1) {
  const { along, front, across } = directions(from, to);
  const { around, arc } = mesh.detail;
  const list = rings(Math.hypot(...subtract(to, from)), start_m, end_m, arc);
  const first = mesh.owner.length;
  for (const { at, radius, slope } of list) {
    for (let i = 0; i < around; i += 1) {
      const turn = (2 * Math.PI * i) / around;
      const [c, s] = [Math.cos(turn), Math.sin(turn)];
      const normal = [0, 1, 2].map(
        (k) =>
          Math.cos(slope) * (c * across[k] + (s * front[k]) / flat) + Math.sin(slope) * along[k],
      );
      for (let k = 0; k < 3; k += 1) {
        mesh.position.push(
          from[k] + at * along[k] + radius * (c * across[k] + flat * s * front[k]),
        );
      }
      mesh.normal.push(...unit(normal));
      mesh.owner.push(owner);
    }
  }
  for (let ring = 0; ring + 1 < list.length; ring += 1) {
    for (let i = 0; i < around; i += 1) {
      const a = first + ring * around + i;
      const b = first + ring * around + ((i + 1) % around);
      mesh.index.push(a, a + around, b, b, a + around, b + around);
    }
  }
}
