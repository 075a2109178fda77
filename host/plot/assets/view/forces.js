// What the ground does to the feet: an arrow a foot, and a disc under each that touches.

import { ConeGeometry, CircleGeometry, CylinderGeometry, Group, Mesh, MeshBasicMaterial, Quaternion, Vector3 } from "three";
import { colour, footColour, onTheme } from "view/theme";

/** Length of the arrow of a foot's share of the weight, and of a force that only one in a hundred exceeds, mm: whichever
 * makes the arrows shorter. What a foot feels as it strikes is many times the rest. */
const SHARE_LENGTH = 14;
const LARGE_LENGTH = 45;
/** Longer ones are cut, mm. */
const LONGEST = 60;
const UP = new Vector3(0, 1, 0);

export class Forces {
  constructor(run) {
    this.run = run;
    this.group = new Group();
    this.scale = roundScale(run);
    // Seen through the modules, which would hide most of them.
    const material = new MeshBasicMaterial({ depthTest: false, transparent: true, opacity: 0.9, fog: false });
    onTheme(() => material.color.copy(colour("force")));
    this.arrows = Array.from({ length: run.feet }, (_, foot) => this.#arrow(material, foot));
    this.state = { centre: new Vector3(), foot: new Vector3(), orientation: new Quaternion(), force: new Vector3() };
  }

  #arrow(material, foot) {
    const shaft = new Mesh(new CylinderGeometry(0.38, 0.38, 1, 12).translate(0, 0.5, 0), material);
    const head = new Mesh(new ConeGeometry(1.25, 3.2, 20).translate(0, -1.6, 0), material);
    shaft.renderOrder = head.renderOrder = 10;
    const arrow = new Group().add(shaft, head);
    const radius = 1000 * (this.run.plan.contact?.foot_radius ?? 0.002);
    const disc = new Mesh(new CircleGeometry(1.7 * radius, 32), new MeshBasicMaterial({ transparent: true, opacity: 0.55, depthWrite: false }));
    onTheme(() => disc.material.color.copy(footColour(foot)));
    this.group.add(arrow, disc);
    return { arrow, shaft, head, disc, radius };
  }

  /** The forces of a sampled state. */
  pose(state) {
    const { run } = this;
    const { centre, foot, orientation, force } = this.state;
    for (const [k, module] of run.plan.modules.entries()) {
      run.pose(state, k, centre, orientation);
      for (const side of [0, 1]) {
        const { arrow, shaft, head, disc, radius } = this.arrows[2 * k + side];
        const at = run.poses + 3 * (2 * k + side);
        force.set(state[at], state[at + 1], state[at + 2]);
        arrow.visible = disc.visible = force.z > 0;
        if (!arrow.visible) continue;
        foot.set(...module.feet[side]).multiplyScalar(1000).applyQuaternion(orientation).add(centre);
        foot.z -= radius;
        const length = Math.min(force.length() * this.scale, LONGEST);
        arrow.position.copy(foot);
        arrow.quaternion.setFromUnitVectors(UP, force.normalize());
        const tip = Math.min(1, length / 4.5);
        head.position.y = length;
        head.scale.setScalar(tip);
        shaft.scale.y = Math.max(length - 3 * tip, 1e-3);
        disc.position.set(foot.x, foot.y, foot.z + 0.15);
      }
    }
  }

  /** What an arrow's length means: the words for a force, and the length in mm. */
  get legend() {
    const length = 10;
    return { length, force: `${Number((length / this.scale).toPrecision(2))} N`, longest: LONGEST };
  }
}

/** Millimetres per newton, so that 10 mm are 1, 2 or 5 times a power of ten. */
function roundScale(run) {
  const gravity = Math.hypot(...run.plan.gravity) || 9.81;
  const share = (run.plan.mass * gravity) / run.feet;
  const newtons = 10 * Math.max(share / SHARE_LENGTH, run.largeForce / LARGE_LENGTH);
  const power = 10 ** Math.floor(Math.log10(newtons));
  const digit = [1, 2, 5, 10].reduce((best, one) => (Math.abs(Math.log(one * power / newtons)) < Math.abs(Math.log(best * power / newtons)) ? one : best));
  return 10 / (digit * power);
}
