// What the scene shows of one stream: its figure or avatar, its feet's trails, its lane.
import { Vector3 } from 'three';
import { feetOf } from '../motion/feet.js';
import { Figure } from './figure.js';
import { Trail } from './trail.js';

export class Performer {
  avatar = null; // an Avatar in place of the capsules
  centre = new Vector3(); // of the hips, in the scene
  top_m = 0; // the height of its highest joint
  #trails = [];

  constructor(stream, scene, theme, detail) {
    this.stream = stream;
    this.ghost = stream.isRaw;
    this.figure = new Figure(stream.kinematics, { ghost: this.ghost, theme, detail });
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
    this.figure.colour(this.stream.pose);
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
    if (this.avatar) {
      this.avatar.pose(stream.kinematics);
    } else {
      figure.place();
      figure.colour(stream.pose);
    }
    this.#measure();
    return true;
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
    let top = -Infinity;
    for (let i = 1; i < position.length; i += 3) top = Math.max(top, position[i]);
    this.top_m += (this.top_m === 0 ? 1 : 0.05) * (top - this.top_m);
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
  }

  dispose() {
    for (const trail of this.#trails) trail.dispose();
    this.avatar?.dispose();
    this.figure.dispose();
  }
}
