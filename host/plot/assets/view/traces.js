// Paths on the ground: each foot's, strong where it touches, and the centroid's.

import { Group, Line2, LineGeometry, LineMaterial, Mesh, MeshBasicMaterial, Quaternion, RingGeometry, Vector3 } from "three";
import { heightAt } from "view/ground";
import { colour, footColour, onTheme } from "view/theme";

/** Points between two frames. */
const FINER = 3;
/** Over the ground, mm: above the shadows' and the grid's errors of depth. */
const LIFT = 0.12;

export class Traces {
  constructor(run) {
    this.run = run;
    this.group = new Group();
    this.lines = [];
    const points = Math.max((run.frames - 1) * FINER + 1, 2);
    const paths = this.#paths(points);
    for (let foot = 0; foot < run.feet; foot++) {
      this.#add(paths[foot], 2.2, (i) => {
        const full = footColour(foot);
        return run.touches(this.#time(i), foot) ? full : full.lerp(colour("grid-strong"), 0.6);
      });
    }
    this.#add(paths[run.feet], 2.6, () => colour("path"));
    this.group.add(start(paths[run.feet]));
  }

  #time(point) {
    return this.run.start + (point / FINER) * this.run.interval;
  }

  /** Of every foot and of the centroid, on the ground: flat lists of x, y, z. */
  #paths(points) {
    const { run } = this;
    const state = new Float64Array(run.channels);
    const paths = Array.from({ length: run.feet + 1 }, () => []);
    const [centre, foot, orientation] = [new Vector3(), new Vector3(), new Quaternion()];
    const put = (path, x, y, over) => path.push(x, y, heightAt(run.plan.contact, x) + LIFT + over);
    for (let i = 0; i < points; i++) {
      run.sample(this.#time(i), state);
      for (const [k, module] of run.plan.modules.entries()) {
        run.pose(state, k, centre, orientation);
        for (const side of [0, 1]) {
          foot.set(...module.feet[side]).multiplyScalar(1000).applyQuaternion(orientation).add(centre);
          put(paths[2 * k + side], foot.x, foot.y, 0);
        }
      }
      const [x, y] = run.centroid(this.#time(i));
      put(paths[run.feet], x, y, 0.05);
    }
    return paths;
  }

  #add(path, width, paint) {
    const geometry = new LineGeometry();
    geometry.setPositions(path);
    const material = new LineMaterial({ linewidth: width, vertexColors: true });
    onTheme(() => {
      const colours = [];
      for (let i = 0; i < path.length / 3; i++) colours.push(...paint(i).toArray());
      geometry.setColors(colours);
    });
    const line = new Line2(geometry, material);
    line.frustumCulled = false;
    this.lines.push({ geometry, count: path.length / 3 - 1 });
    this.group.add(line);
  }

  /** Draws what has been walked until a time. */
  until(time) {
    const share = this.run.end > this.run.start ? (time - this.run.start) / (this.run.end - this.run.start) : 0;
    for (const { geometry, count } of this.lines) geometry.instanceCount = Math.round(share * count);
  }
}

/** Where the centroid starts. */
function start(path) {
  const ring = new Mesh(new RingGeometry(1.6, 2.4, 32), new MeshBasicMaterial());
  ring.position.set(path[0], path[1], path[2] + 0.02);
  onTheme(() => ring.material.color.copy(colour("path")));
  return ring;
}
