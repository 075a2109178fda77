// The walls that modules run into.

import { BoxGeometry, Group, Mesh, MeshLambertMaterial } from "three";
import { colour, onTheme } from "view/theme";

/** Drawn so high and so thick, mm: what is simulated has no thickness and no upper edge. */
const HEIGHT = 25;
const THICKNESS = 2;

export function walls(run) {
  const group = new Group();
  const material = new MeshLambertMaterial({ transparent: true, opacity: 0.75 });
  for (const [x0, y0, x1, y1] of run.plan.walls.map((wall) => wall.map((end) => 1000 * end))) {
    const length = Math.hypot(x1 - x0, y1 - y0);
    const wall = new Mesh(new BoxGeometry(length + THICKNESS, THICKNESS, HEIGHT), material);
    wall.position.set((x0 + x1) / 2, (y0 + y1) / 2, HEIGHT / 2);
    wall.rotation.z = Math.atan2(y1 - y0, x1 - x0);
    wall.castShadow = true;
    group.add(wall);
  }
  onTheme(() => material.color.copy(colour("metal")));
  return group;
}
