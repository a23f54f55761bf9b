// What the scene shows of one stream: its figure or avatar, its feet's trails, its lane.
import { Vector3 } from 'three';
import { feetOf } from '../motion/feet.js';
import { Figure } from './figure.js';
import { Trail } from './trail.js';

const ABOVE_JOINTS_M = 0.27; // what a head has above its joint
const joint = new Vector3();
const away = new Vector3();
const beside = new Vector3();

export class Performer {
  avatar = null; // an Avatar in place of the capsules
  lane = new Vector3(); // where its world's origin is in the scene
  centre = new Vector3(); // of the hips, in the scene
  above = new Vector3();
  head = { middle: 0, half: 0 };
  #trails = [];

  // number: of its colour; a raw one is grey
  constructor(stream, scene, theme, detail, number) {
    this.stream = stream;
    this.ghost = stream.isRaw;
    this.figure = new Figure(stream.kinematics, { ghost: this.ghost, theme, detail, number });
    this.figure.group.visible = false;
    scene.add(this.figure.group);
    const { own } = this.figure;
    if (stream.isHand) return;
    this.#trails = feetOf(stream.kinematics).map(
      (foot) => new Trail(foot, { ghost: this.ghost, colour: own }),
    );
    for (const trail of this.#trails) this.figure.group.add(trail.group);
    this.hips = Math.max(stream.kinematics.jointOf('hips'), 0);
  }

  setTheme(theme) {
    this.figure.setTheme(theme);
    for (const trail of this.#trails) trail.setColour(this.figure.own);
    this.#colour();
  }

  // Shows the newest pose; false when there is none.
  update(showTrails) {
    const { stream, figure } = this;
    if (!stream.place()) return false;
    for (const trail of this.#trails) {
      trail.foot.update(stream.kinematics, stream.pose.arrival_ms);
      trail.update();
      trail.group.visible = showTrails;
    }
    figure.group.visible = true;
    if (this.avatar) this.avatar.pose(stream.kinematics);
    else figure.place();
    this.#colour();
    this.#measure();
    return true;
  }

  // In its lane.
  standIn(x, z) {
    this.lane.set(x, 0, z);
    this.#moveTo(this.lane);
  }

  #moveTo(place) {
    const { position } = this.figure.group;
    this.centre.sub(position).add(place);
    position.copy(place);
  }

  // Where it is too far from another, it jumps to its side, and stays there: feet that stand do not
  // glide.
  keepNear(other, most_m) {
    away.subVectors(this.centre, other.centre).setY(0);
    if (away.length() <= most_m) return;
    away.subVectors(this.lane, other.lane).setY(0);
    beside.copy(other.centre).add(away).sub(this.centre).setY(0).add(this.figure.group.position);
    this.#moveTo(beside);
  }

  #colour() {
    const { avatar, figure } = this;
    if (avatar) avatar.paint(figure.own, this.stream.pose);
    else figure.colour(this.stream.pose, this.stream.stats);
  }

  // Its colour for the page's own parts.
  get colour() {
    return `#${this.figure.own.getHexString()}`;
  }

  get jumped() {
    return this.#trails.some(({ foot }) => foot.jumped);
  }

  #measure() {
    const { position } = this.stream.kinematics;
    const at = 3 * (this.hips ?? 0);
    this.centre
      .set(position[at], position[at + 1], position[at + 2])
      .add(this.figure.group.position);
  }

  // Finds `above`, a point in this camera's picture above whatever of the body is highest there,
  // and `head`, how far that reaches to the left and right: a name there covers none of it.
  findTop(camera) {
    const { above, head } = this;
    const { position } = this.stream.kinematics;
    const { group } = this.figure;
    const scale = this.avatar?.scale ?? 1;
    let top = -Infinity;
    for (let i = 0; i < position.length; i += 3) {
      joint.set(position[i], scale * position[i + 1], position[i + 2]).add(group.position);
      if (joint.project(camera).y <= top) continue;
      top = joint.y;
      head.middle = joint.x;
    }
    above.copy(this.centre);
    above.y *= scale;
    const depth = joint.copy(above).applyMatrix4(camera.matrixWorldInverse).z;
    const above_m = ABOVE_JOINTS_M * this.figure.scale;
    const room = (above_m * camera.projectionMatrix.elements[5]) / -depth;
    above.project(camera);
    above.y = top + room;
    const [across, , , , , up] = camera.projectionMatrix.elements;
    head.half = (0.5 * room * across) / up;
  }

  // Capsules again, or an avatar in their place.
  wear(avatar) {
    this.avatar?.dispose();
    this.avatar = avatar;
    for (const child of this.figure.group.children) {
      if (child.isSkinnedMesh) child.visible = avatar === null;
    }
    if (!avatar) return;
    this.figure.group.add(avatar.group);
    avatar.fit(this.stream.kinematics);
    if (this.stream.drawable) avatar.pose(this.stream.kinematics);
    this.#colour();
  }

  dispose() {
    for (const trail of this.#trails) trail.dispose();
    this.avatar?.dispose();
    this.figure.dispose();
  }
}
