// The colours of a mesh whose vertices each belong to a joint: its performer's own, and what the
// pose says of each joint in its place. The vertices are written on a change only.
import { BufferAttribute } from 'three';
import { STOPPED, jointColour } from './palette.js';

export class JointPaint {
  #painted = '';

  // owner: the joint of each vertex
  constructor(geometry, owner) {
    this.owner = owner;
    this.colours = new BufferAttribute(new Float32Array(3 * owner.length), 3);
    geometry.setAttribute('color', this.colours);
  }

  // own: the performer's colour; stopped: joints of a robot
  paint(own, pose, stopped = []) {
    const atRest = pose.performed && pose.quality === 2;
    let key = `${own.getHex()}${pose.quality}${atRest}!${stopped}`;
    for (let joint = 0; joint < pose.validJoints; joint += 1) {
      if (pose.validity[joint] === 0) key += `,${joint}`;
    }
    if (key === this.#painted) return;
    this.#painted = key;
    const { array } = this.colours;
    this.owner.forEach((joint, i) => {
      const hasValue = joint >= pose.validJoints || pose.validity[joint] !== 0;
      const colour = stopped.includes(joint)
        ? STOPPED
        : jointColour(own, pose.quality, hasValue, atRest);
      colour.toArray(array, 3 * i);
    });
    this.colours.needsUpdate = true;
  }
}
