// What the feet leave behind: the path of the toes over the last seconds, a print where a foot
// stood, and a ring below a foot that stands now.
import {
  BufferAttribute,
  BufferGeometry,
  CircleGeometry,
  DynamicDrawUsage,
  Group,
  InstancedMesh,
  Line,
  LineBasicMaterial,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  RingGeometry,
} from 'three';
import { CONTACT } from './palette.js';

const POINTS = 150;
const PRINTS = 12;
const PRINT_HEIGHT_M = 0.004;

const flat = (geometry) => geometry.rotateX(-Math.PI / 2);

function makeLine(opacity) {
  const geometry = new BufferGeometry();
  const place = new BufferAttribute(new Float32Array(3 * POINTS), 3).setUsage(DynamicDrawUsage);
  geometry.setAttribute('position', place);
  const fade = new Float32Array(4 * POINTS);
  for (let i = 0; i < POINTS; i += 1)
    fade.set([1, 1, 1, opacity * (i / (POINTS - 1)) ** 1.6], 4 * i);
  geometry.setAttribute('color', new BufferAttribute(fade, 4));
  const material = new LineBasicMaterial({
    vertexColors: true,
    transparent: true,
    depthWrite: false,
  });
  const line = new Line(geometry, material);
  line.frustumCulled = false;
  return line;
}

export class Trail {
  group = new Group();
  #count = 0; // points so far
  #stood = false;
  #nextPrint = 0;

  constructor(foot, { ghost, colour }) {
    this.foot = foot;
    this.line = makeLine(ghost ? 0.5 : 0.9);
    this.prints = new InstancedMesh(
      flat(new CircleGeometry(0.05, 20)),
      new MeshBasicMaterial({ transparent: true, opacity: ghost ? 0.18 : 0.34, depthWrite: false }),
      PRINTS,
    );
    this.prints.frustumCulled = false;
    this.prints.count = 0;
    this.ring = new Mesh(
      flat(new RingGeometry(0.065, 0.085, 28)),
      new MeshBasicMaterial({
        color: CONTACT,
        transparent: true,
        opacity: ghost ? 0.4 : 0.95,
        depthWrite: false,
      }),
    );
    this.ring.visible = false;
    this.group.add(this.line, this.prints, this.ring);
    this.setColour(colour);
  }

  setColour(colour) {
    this.line.material.color = colour;
    this.prints.material.color = colour;
  }

  // After each pose.
  update() {
    const { foot } = this;
    if (foot.jumped) this.clear();
    const { position } = this.line.geometry.attributes;
    const { array } = position;
    if (this.#count === 0) for (let i = 0; i < POINTS; i += 1) array.set(foot.point, 3 * i);
    array.copyWithin(0, 3);
    array.set(foot.point, 3 * (POINTS - 1));
    position.needsUpdate = true;
    this.#count += 1;
    this.ring.visible = foot.stands;
    this.ring.position.set(foot.point[0], PRINT_HEIGHT_M, foot.point[2]);
    if (foot.stands && !this.#stood) this.#print();
    this.#stood = foot.stands;
  }

  #print() {
    const { point } = this.foot;
    matrix.makeTranslation(point[0], 0.5 * PRINT_HEIGHT_M, point[2]);
    this.prints.setMatrixAt(this.#nextPrint, matrix);
    this.prints.instanceMatrix.needsUpdate = true;
    this.#nextPrint = (this.#nextPrint + 1) % PRINTS;
    this.prints.count = Math.max(this.prints.count, this.#nextPrint);
    if (this.#nextPrint === 0) this.prints.count = PRINTS;
  }

  clear() {
    this.#count = 0;
    this.#nextPrint = 0;
    this.#stood = false;
    this.prints.count = 0;
  }

  dispose() {
    this.group.removeFromParent();
    for (const { geometry, material } of [this.line, this.prints, this.ring]) {
      geometry.dispose();
      material.dispose();
    }
    this.prints.dispose();
  }
}

const matrix = new Matrix4();
