// A body or hand of capsules in the scene: one mesh whose joints move. A ghost is drawn in two
// passes, depth first, so that it is evenly translucent where limbs lie behind each other.
import {
  Bone,
  BufferAttribute,
  BufferGeometry,
  DetachedBindMode,
  Group,
  Matrix4,
  MeshBasicMaterial,
  MeshLambertMaterial,
  Skeleton,
  SkinnedMesh,
} from 'three';
import { bodyShape } from './body_shape.js';
import { performerColour } from './palette.js';
import { rigid } from './rigid_skin.js';
import { JointPaint } from './joint_paint.js';
import { stoppedJoints } from './robot_shape.js';

// A skeleton whose matrices the page writes itself: three.js then walks no tree of bones.
class DirectSkeleton extends Skeleton {
  constructor(count) {
    super(
      Array.from({ length: count }, () => new Bone()),
      Array.from({ length: count }, () => new Matrix4()),
    );
  }

  update() {} // `Figure.place` has written boneMatrices
}

function geometryOf(shape) {
  const geometry = new BufferGeometry();
  const vertices = shape.owner.length;
  const skinIndex = new Uint16Array(4 * vertices);
  const skinWeight = new Float32Array(4 * vertices);
  for (let i = 0; i < vertices; i += 1) {
    skinIndex[4 * i] = shape.owner[i];
    skinWeight[4 * i] = 1;
  }
  geometry.setAttribute('position', new BufferAttribute(shape.position, 3));
  geometry.setAttribute('normal', new BufferAttribute(shape.normal, 3));
  geometry.setAttribute('skinIndex', new BufferAttribute(skinIndex, 4));
  geometry.setAttribute('skinWeight', new BufferAttribute(skinWeight, 4));
  geometry.setIndex(shape.index);
  return geometry;
}

function skinned(geometry, material, skeleton) {
  const mesh = new SkinnedMesh(geometry, material);
  mesh.bindMode = DetachedBindMode;
  mesh.bind(skeleton, new Matrix4());
  mesh.frustumCulled = false; // its bounds are those of the T-pose
  return mesh;
}

export class Figure {
  group = new Group(); // moved by the lane

  // number: of the performer's colour
  constructor(kinematics, { ghost, theme, detail, number }) {
    this.kinematics = kinematics;
    this.ghost = ghost;
    this.number = number;
    const shape = bodyShape(kinematics, detail);
    this.scale = shape.scale;
    this.geometry = geometryOf(shape);
    this.joints = new JointPaint(this.geometry, shape.owner);
    this.skeleton = new DirectSkeleton(kinematics.count);
    this.skeleton.computeBoneTexture();
    this.#makeMeshes();
    this.setTheme(theme);
  }

  #makeMeshes() {
    const { geometry, skeleton, ghost } = this;
    this.material = rigid(new MeshLambertMaterial({ vertexColors: true }));
    const mesh = skinned(geometry, this.material, skeleton);
    mesh.castShadow = !ghost;
    mesh.receiveShadow = false;
    this.group.add(mesh);
    if (!ghost) return;
    this.material.transparent = true;
    this.material.depthWrite = false;
    this.depthMaterial = rigid(new MeshBasicMaterial({ colorWrite: false }));
    const depth = skinned(geometry, this.depthMaterial, skeleton);
    depth.renderOrder = 1;
    mesh.renderOrder = 2;
    this.group.add(depth);
  }

  setTheme(theme) {
    this.own = this.ghost ? theme.raw : performerColour(theme, this.number);
    if (this.ghost) this.material.opacity = theme.rawOpacity;
  }

  // Moves the joints to where `kinematics` has placed them.
  place() {
    const { rotation, position, count } = this.kinematics;
    const matrices = this.skeleton.boneMatrices;
    for (let joint = 0; joint < count; joint += 1)
      writeMatrix(matrices, 16 * joint, rotation, 4 * joint, position, 3 * joint);
    this.skeleton.boneTexture.needsUpdate = true;
  }

  // Colours the joints by what the pose says about them.
  colour(pose, stats) {
    this.joints.paint(this.own, pose, stoppedJoints(this.kinematics, stats));
  }

  dispose() {
    this.group.removeFromParent();
    this.geometry.dispose();
    this.material.dispose();
    this.depthMaterial?.dispose();
    this.skeleton.dispose();
  }
}

// A rotation and a position as a matrix in three.js's order, columns first.
function writeMatrix(out, o, q, i, p, j) {
  const x = q[i],
    y = q[i + 1],
    z = q[i + 2],
    w = q[i + 3];
  out[o] = 1 - 2 * (y * y + z * z);
  out[o + 1] = 2 * (x * y + w * z);
  out[o + 2] = 2 * (x * z - w * y);
  out[o + 3] = 0;
  out[o + 4] = 2 * (x * y - w * z);
  out[o + 5] = 1 - 2 * (x * x + z * z);
  out[o + 6] = 2 * (y * z + w * x);
  out[o + 7] = 0;
  out[o + 8] = 2 * (x * z + w * y);
  out[o + 9] = 2 * (y * z - w * x);
  out[o + 10] = 1 - 2 * (x * x + y * y);
  out[o + 11] = 0;
  out[o + 12] = p[j];
  out[o + 13] = p[j + 1];
  out[o + 14] = p[j + 2];
  out[o + 15] = 1;
}
