// The robot's rigid parts: modules on their legs, motor and eccentric.

import {
  BoxGeometry, CanvasTexture, CapsuleGeometry, CylinderGeometry, Group, Mesh, MeshBasicMaterial, MeshStandardMaterial, PlaneGeometry,
  RoundedBoxGeometry, SphereGeometry, SRGBColorSpace, TorusGeometry,
} from "three";
import { Backbone } from "view/backbone";
import { colour, drawn, footColour, onTheme } from "view/theme";

export class Robot {
  constructor(run) {
    this.run = run;
    this.group = new Group();
    this.modules = run.plan.modules.map((module, k) => this.#module(module, k));
    this.group.add(...this.modules);
    let first = run.modules;
    this.backbones = run.plan.backbones.map((backbone, b) => {
      const beam = new Backbone(backbone, { first, front: b, lengths: [b, b + 1].map((k) => 1000 * run.plan.modules[k].size[0]) });
      first += backbone.segments;
      this.group.add(beam.mesh);
      return beam;
    });
    if (run.rotor !== null) this.#eccentric(run.plan.eccentric, run.plan.modules[0]);
  }

  #module(module, k) {
    const group = new Group();
    const [length, width, height] = module.size.map((metres) => 1000 * metres);
    const shell = new RoundedBoxGeometry(length, width, height, 3, Math.min(1.4, 0.2 * height));
    group.add(part(shell, painted(module.kind === "courier" ? "courier" : "shell", 0.6)));
    if (module.kind === "courier") group.add(...battery(length, width, height));
    if (this.run.plan.clamped === k) group.add(clamp(height));
    group.add(number(k + 1, length, height));
    const radius = 1000 * (this.run.plan.contact?.foot_radius ?? 0.002);
    for (const [side, place] of module.feet.entries()) {
      const [x, y, z] = place.map((metres) => 1000 * metres);
      const thickness = 0.6 * radius;
      // The leg's round ends sit in the module and in the foot.
      const leg = part(new CapsuleGeometry(thickness, -0.5 * height - z, 4, 12), painted("leg", 0.7));
      leg.rotation.x = 0.5 * Math.PI;
      leg.position.set(x, y, 0.5 * (z - 0.5 * height));
      const foot = part(new SphereGeometry(radius, 24, 16), new MeshStandardMaterial({ roughness: 0.5 }));
      onTheme(() => foot.material.color.copy(footColour(2 * k + side)));
      foot.position.set(x, y, z);
      group.add(leg, foot);
    }
    return group;
  }

  #eccentric(eccentric, module) {
    const top = 500 * module.size[2];
    const [radius, height] = [1000 * eccentric.radius, 1000 * eccentric.height];
    const [boltRadius, boltLength] = [1000 * eccentric.bolt_radius, 1000 * eccentric.bolt_length];
    const wide = Math.min(3, 0.2 * Math.min(...module.size.slice(0, 2).map((metres) => 1000 * metres)));
    // The arm holds the bolt at its lower end, the motor ends below the arm.
    const arm = height - 0.5 * boltLength + 0.8;
    const motorTop = Math.max(arm - 2.5, top + 1);
    const motor = upright(new CylinderGeometry(wide, wide, motorTop - top, 32), painted("motor", 0.35, 0.5));
    motor.position.z = 0.5 * (motorTop + top);
    const shaft = upright(new CylinderGeometry(0.6, 0.6, arm + 1 - motorTop, 16), painted("metal", 0.3, 0.7));
    shaft.position.z = 0.5 * (motorTop + arm + 1);
    this.turning = new Group();
    const bar = part(new BoxGeometry(radius + 2.4, 2.4, 1.4), painted("metal", 0.35, 0.6));
    bar.position.set(0.5 * radius, 0, arm);
    const bolt = upright(new CylinderGeometry(boltRadius, boltRadius, boltLength, 24), painted("bolt", 0.4, 0.2));
    bolt.position.set(radius, 0, height);
    const head = upright(new CylinderGeometry(1.9 * boltRadius, 1.9 * boltRadius, 0.25 * boltLength, 6), painted("bolt", 0.4, 0.2));
    head.position.set(radius, 0, height + 0.5 * boltLength);
    this.turning.add(bar, bolt, head);
    const circle = new Mesh(new TorusGeometry(radius, 0.18, 8, 96), new MeshBasicMaterial({ transparent: true, opacity: 0.45 }));
    onTheme(() => circle.material.color.copy(colour("bolt")));
    circle.position.z = height;
    this.rotor = new Group();
    this.rotor.add(motor, shaft, this.turning, circle);
    this.modules[0].add(this.rotor);
  }

  /** Takes the pose of a sampled state. */
  pose(state) {
    for (const [k, module] of this.modules.entries()) this.run.pose(state, k, module.position, module.quaternion);
    for (const beam of this.backbones) beam.pose(this.run, state);
    if (this.rotor) this.turning.rotation.z = state[this.run.rotor];
  }
}

function part(geometry, material) {
  const mesh = new Mesh(geometry, material);
  mesh.castShadow = mesh.receiveShadow = true;
  return mesh;
}

/** A body of revolution about z. */
function upright(geometry, material) {
  geometry.rotateX(0.5 * Math.PI);
  return part(geometry, material);
}

const paints = new Map();

/** The material of a colour of the style sheet. */
export function painted(name, roughness, metalness = 0) {
  if (!paints.has(name)) {
    const material = new MeshStandardMaterial({ roughness, metalness });
    onTheme(() => material.color.copy(colour(name)));
    paints.set(name, material);
  }
  return paints.get(name);
}

/** The courier's battery and electronics, on its upper side. */
function battery(length, width, height) {
  const cell = part(new RoundedBoxGeometry(0.8 * length, 0.3 * width, 2.6, 2, 0.8), painted("metal", 0.4, 0.3));
  cell.position.set(0, -0.3 * width, 0.5 * height + 1.3);
  const chip = part(new RoundedBoxGeometry(0.6 * length, 0.22 * width, 1.6, 2, 0.3), painted("leg", 0.7));
  chip.position.set(0, 0.32 * width, 0.5 * height + 0.8);
  return [cell, chip];
}

/** What holds a clamped module: a rod from above. */
function clamp(height) {
  const rod = upright(new CylinderGeometry(1.6, 1.6, 60, 24), painted("leg", 0.7));
  rod.position.z = 0.5 * height + 30;
  return rod;
}

/** A module's number on its upper side, behind its middle. */
function number(value, length, height) {
  const material = new MeshBasicMaterial({ transparent: true, depthWrite: false });
  const text = drawn(96, 96, (context) => {
    context.font = "600 72px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillStyle = "rgb(12 18 26 / .8)";
    context.fillText(String(value), 48, 52);
  });
  material.map = new CanvasTexture(text);
  material.map.colorSpace = SRGBColorSpace;
  material.map.anisotropy = 8;
  const size = 0.36 * length;
  const plane = new Mesh(new PlaneGeometry(size, size), material);
  plane.position.set(-0.28 * length, 0, 0.5 * height + 0.06);
  return plane;
}
