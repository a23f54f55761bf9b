// The mannequin: a VRM 1.0 avatar of capsules, made from a list of bones. `mannequin()` returns the
// bytes of the file.
import { FINE, Mesh, addCapsule } from '../src/scene/capsule.js';
import { figure } from './bones.mjs';
import { glb } from './glb.mjs';

const SKIN = [0.86, 0.8, 0.72, 1];
const TRUNK_DEPTH = 0.72;

// Joints, parents first: {bone, parent, place: in the world, radius, ends: capsules to draw}.
function joints(node, parent, above, list) {
  const place = node.offset.map((value, k) => value + above[k]);
  const index = list.length;
  list.push({ ...node, parent, place });
  for (const child of node.children ?? []) joints(child, index, place, list);
  return list;
}

function shape(list, detail) {
  const mesh = new Mesh(detail);
  list.forEach((joint, i) => {
    const above = list[joint.parent];
    if (above) {
      const depth = above.trunk ? TRUNK_DEPTH : 1;
      const start = above.trunk && !joint.trunk ? joint.radius : above.radius;
      addCapsule(mesh, above.place, joint.place, start, joint.radius, joint.parent, depth);
    }
    if (!joint.tip) return;
    const tip = joint.tip.map((value, k) => value + joint.place[k]);
    const [from, start] = joint.round
      ? [tip, joint.tipRadius]
      : [joint.place, joint.tipStart ?? joint.radius];
    addCapsule(mesh, from, tip, start, joint.tipRadius, i, joint.trunk ? TRUNK_DEPTH : 1);
  });
  return mesh;
}

const META = {
  name: 'posed mannequin',
  version: '1',
  authors: ['posed'],
  licenseUrl: 'https://vrm.dev/licenses/1.0/',
  avatarPermission: 'everyone',
  commercialUsage: 'corporation',
  modification: 'allowModificationRedistribution',
  allowRedistribution: true,
  creditNotation: 'unnecessary',
};

// detail: FINE, or COARSE for where the processor draws
export function mannequin(detail = FINE) {
  const list = joints(figure, -1, [0, 0, 0], []);
  const humanBones = Object.fromEntries(list.map(({ bone }, node) => [bone, { node }]));
  return glb({
    joints: list,
    mesh: shape(list, detail),
    colour: SKIN,
    extensions: { VRMC_vrm: { specVersion: '1.0', meta: META, humanoid: { humanBones } } },
  });
}
