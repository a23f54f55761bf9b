// A VRM avatar that moves as a stream does. Rotations are those of VRM's bones relative to the bone
// above, all identity in the T-pose; the hips move in proportion to the avatar's leg length.
import { Group, MeshLambertMaterial } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { VRMLoaderPlugin, VRMUtils } from '@pixiv/three-vrm';
import { rotate } from '../motion/quaternion.js';
import { JointPaint } from './joint_paint.js';

const MANNEQUIN = 'posed mannequin'; // the name in its file

function loader() {
  const gltf = new GLTFLoader();
  gltf.register((parser) => new VRMLoaderPlugin(parser));
  return gltf;
}

// bytes: an ArrayBuffer with a .vrm. Rejects with a sentence.
export async function loadAvatar(bytes, name) {
  let gltf;
  try {
    gltf = await loader().parseAsync(bytes, '');
  } catch (error) {
    throw new Error(`${name} cannot be read as VRM: ${error.message}`);
  }
  const { vrm } = gltf.userData;
  if (!vrm) throw new Error(`${name} is no VRM avatar: it has no humanoid`);
  return new Avatar(vrm, name);
}

export class Avatar {
  group = new Group();
  #bones = []; // {bone, node, joint}: of the figure that it was fitted to
  #boneAbove = []; // the next joint above, by joint, whose bone the avatar has
  #scale = 1;
  #hips = -1;
  #paints = []; // of the mannequin: another avatar keeps its own colours

  constructor(vrm, name) {
    this.vrm = vrm;
    this.name = name;
    VRMUtils.rotateVRM0(vrm); // older avatars face -Z
    this.turned = vrm.meta?.metaVersion === '0' ? -1 : 1;
    vrm.scene.traverse((object) => {
      object.frustumCulled = false;
      object.castShadow = object.isMesh === true;
    });
    this.group.add(vrm.scene);
  }

  // Finds the avatar's bones for the figure's joints, and how much longer its legs are.
  fit(kinematics) {
    const { humanoid } = this.vrm;
    const nodeOf = (bone) => (bone ? humanoid.getNormalizedBoneNode(bone) : null);
    this.#bones = [];
    kinematics.bones.forEach((bone, joint) => {
      const node = nodeOf(bone);
      if (node) this.#bones.push({ bone, node, joint });
    });
    // The turn of a bone that the avatar lacks, like upperChest, goes to the bones below it.
    this.#boneAbove = kinematics.bonesAbove((bone) => Boolean(nodeOf(bone)));
    this.#hips = kinematics.jointOf('hips');
    const own_m = humanoid.getNormalizedBoneNode('hips').position.y;
    const legs_m = hipsHeight(kinematics);
    this.#scale = legs_m > 0 ? own_m / legs_m : 1;
    if (this.vrm.meta?.name === MANNEQUIN) this.#becomePainted();
  }

  // How much taller it is than the figure.
  get scale() {
    return this.#scale;
  }

  // Each vertex belongs to the figure's joint that moves it, or to one above where it has none.
  #becomePainted() {
    const jointOf = new Map();
    const { humanoid } = this.vrm;
    for (const { bone, joint } of this.#bones) jointOf.set(humanoid.getRawBoneNode(bone), joint);
    const moving = (node) => {
      if (!node) return 0;
      return jointOf.get(node) ?? moving(node.parent);
    };
    this.#paints = [];
    this.vrm.scene.traverse((mesh) => {
      if (!mesh.isSkinnedMesh) return;
      const joints = mesh.skeleton.bones.map(moving);
      const { skinIndex } = mesh.geometry.attributes;
      const owner = Array.from({ length: skinIndex.count }, (_, i) => joints[skinIndex.getX(i)]);
      for (const material of [mesh.material].flat()) material.dispose();
      mesh.material = new MeshLambertMaterial({ vertexColors: true });
      this.#paints.push(new JointPaint(mesh.geometry, owner));
    });
  }

  // In the performer's colour, and by what the pose says of each joint.
  paint(own, pose) {
    for (const paint of this.#paints) paint.paint(own, pose);
  }

  get isPainted() {
    return this.#paints.length > 0;
  }

  pose(kinematics) {
    const local = kinematics.humanoidLocals(this.#boneAbove);
    const { turned } = this;
    for (const { node, joint } of this.#bones) {
      const i = 4 * joint;
      node.quaternion.set(turned * local[i], local[i + 1], turned * local[i + 2], local[i + 3]);
    }
    if (this.#hips >= 0) this.#placeHips(kinematics.position, 3 * this.#hips);
    this.vrm.update(0);
  }

  // Frees what it holds on the graphics card: tens of megabytes for a usual avatar.
  dispose() {
    this.group.removeFromParent();
    VRMUtils.deepDispose(this.vrm.scene);
  }

  // The avatar's ground is the scene's; it walks as far as the figure does.
  #placeHips(position, i) {
    const node = this.vrm.humanoid.getNormalizedBoneNode('hips');
    node.position.set(0, position[i + 1] * this.#scale, 0);
    this.group.position.set(position[i], 0, position[i + 2]);
  }
}

// Of the figure's T-pose: from its lowest point, of joints and tips, to the hips [m].
export function hipsHeight(kinematics) {
  const hips = kinematics.jointOf('hips');
  if (hips < 0) return 0;
  const places = kinematics.restPositions();
  let low = Infinity;
  const tip = [0, 0, 0];
  for (let joint = 0; joint < kinematics.count; joint += 1) {
    const height_m = places[3 * joint + 1];
    rotate(tip, 0, kinematics.rest, 4 * joint, kinematics.tip, 3 * joint);
    low = Math.min(low, height_m, Number.isNaN(tip[1]) ? height_m : height_m + tip[1]);
  }
  return places[3 * hips + 1] - low;
}
