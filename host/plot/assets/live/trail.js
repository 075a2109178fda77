// Where the robot has come from: the path of the calm centroid on the ground.

import { Group, Line2, LineGeometry, LineMaterial } from "three";
import { heightAt } from "view/ground";
import { colour, onTheme } from "view/theme";

/** Distance of its points, mm, and how many are kept. */
const STEP = 0.5;
const MOST = 2000;
/** Over the ground, mm. */
const LIFT = 0.15;

export class Trail {
  constructor(contact) {
    this.contact = contact;
    this.group = new Group();
    this.points = [];
    this.material = new LineMaterial({ linewidth: 2.6 });
    onTheme(() => this.material.color.copy(colour("path")));
  }

  /** Goes on to a point, or begins anew where it is far away. */
  to([x, y]) {
    const [lastX, lastY] = this.points.at(-1) ?? [Infinity, Infinity];
    const away = Math.hypot(x - lastX, y - lastY);
    if (away < STEP) return;
    if (away > 50) this.points.length = 0;
    this.points.push([x, y]);
    if (this.points.length > MOST) this.points.shift();
    if (this.points.length > 1) this.#draw();
  }

  #draw() {
    if (this.line) {
      this.group.remove(this.line);
      this.line.geometry.dispose();
    }
    const geometry = new LineGeometry();
    geometry.setPositions(this.points.flatMap(([x, y]) => [x, y, heightAt(this.contact, x) + LIFT]));
    this.line = new Line2(geometry, this.material);
    this.line.frustumCulled = false;
    this.group.add(this.line);
  }
}
