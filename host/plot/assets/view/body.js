// What a body is made of, and where its numbers stand in a state: position and orientation of every module, then of every
// segment, the force on every foot, and with a rotor its angle and its frequency.
// Lengths of a state are millimetres; angles rad, forces N, counter-clockwise positive, but the rotor's frequency is
// in Hz and positive clockwise seen from above, as people count it.

export const POSE = 7; // x y z, w x y z

export class Body {
  /** `plan` as `host/plot/src/view/scene.rs` writes it, and how many numbers a state has. */
  constructor(plan, channels) {
    this.plan = plan;
    this.channels = channels;
    this.modules = plan.modules.length;
    this.segments = plan.backbones.reduce((sum, backbone) => sum + backbone.segments, 0);
    this.feet = 2 * this.modules;
    this.poses = POSE * (this.modules + this.segments);
    this.rotor = plan.eccentric && this.poses + 3 * this.feet < channels ? this.poses + 3 * this.feet : null;
  }

  /** Whether a channel is a length, which files have in metres. */
  isLength(channel) {
    return channel < this.poses && channel % POSE < 3;
  }

  /** Part `index` (modules, then segments) of a state, into a position and a quaternion of three.js. */
  pose(state, index, position, quaternion) {
    const at = POSE * index;
    position.set(state[at], state[at + 1], state[at + 2]);
    quaternion.set(state[at + 4], state[at + 5], state[at + 6], state[at + 3]).normalize();
  }

  /** Mean of the modules' centres of a state. */
  centroidOf(state) {
    const mean = [0, 0, 0];
    for (let k = 0; k < this.modules; k++) for (let axis = 0; axis < 3; axis++) mean[axis] += state[POSE * k + axis] / this.modules;
    return mean;
  }

  /** Heading of a state, −π … π: of the line from the last module to the first. */
  headingOf(state) {
    const last = POSE * (this.modules - 1);
    return Math.atan2(state[1] - state[last + 1], state[0] - state[last]);
  }
}
