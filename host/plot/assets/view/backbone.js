// A soft backbone: an I-beam drawn smoothly through its segments.

import { BufferAttribute, BufferGeometry, DoubleSide, DynamicDrawUsage, Mesh, MeshStandardMaterial, Quaternion, Vector3 } from "three";
import { colour, onTheme } from "view/theme";

/** Outline of an I in a box of 1 × 1 (across, up): flanges of a quarter of the height, a web of a third of the width. */
const FLANGE = 0.25;
const WEB = 0.17;
const OUTLINE = [
  [-0.5, -0.5], [0.5, -0.5], [0.5, FLANGE - 0.5], [WEB, FLANGE - 0.5], [WEB, 0.5 - FLANGE], [0.5, 0.5 - FLANGE],
  [0.5, 0.5], [-0.5, 0.5], [-0.5, 0.5 - FLANGE], [-WEB, 0.5 - FLANGE], [-WEB, FLANGE - 0.5], [-0.5, FLANGE - 0.5],
];
/** The edges of the flange that is up before the beam is rolled: of another colour, so that the roll can be seen. */
const TOP_EDGES = new Set([5, 6, 7, 8]);
const EDGES = OUTLINE.map((from, i) => {
  const to = OUTLINE[(i + 1) % OUTLINE.length];
  return { from, to, top: TOP_EDGES.has(i) };
});

const place = new Vector3();
const turn = new Quaternion();

export class Backbone {
  /** `where`: index of its first segment among the parts, of the module in front, and the two modules' lengths in mm. */
  constructor(backbone, where) {
    this.where = where;
    this.segments = backbone.segments;
    this.half = (500 * backbone.length) / backbone.segments;
    this.roll = new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), backbone.roll);
    const [width, height] = backbone.section.map((metres) => 1000 * metres);
    this.edges = EDGES.map(({ from, to, top }) => {
      const ends = [from, to].map(([y, z]) => new Vector3(0, y * width, z * height));
      const along = ends[1].clone().sub(ends[0]).normalize();
      return { ends, normal: new Vector3(0, along.z, -along.y), top };
    });
    this.stations = Array.from({ length: this.segments + 1 }, () => ({ position: new Vector3(), orientation: new Quaternion() }));
    this.mesh = this.#mesh();
  }

  #mesh() {
    const rows = this.stations.length;
    const points = 2 * this.edges.length * rows;
    this.geometry = new BufferGeometry();
    for (const name of ["position", "normal"]) {
      this.geometry.setAttribute(name, new BufferAttribute(new Float32Array(3 * points), 3).setUsage(DynamicDrawUsage));
    }
    const index = [];
    for (let edge = 0; edge < this.edges.length; edge++) {
      for (let row = 0; row + 1 < rows; row++) {
        const a = 2 * (edge * rows + row);
        index.push(a, a + 1, a + 3, a, a + 3, a + 2);
      }
    }
    this.geometry.setIndex(index);
    const colours = new BufferAttribute(new Float32Array(3 * points), 3);
    this.geometry.setAttribute("color", colours);
    onTheme(() => {
      const [beam, top] = [colour("beam"), colour("beam-top")];
      for (let i = 0; i < points; i++) {
        const paint = this.edges[Math.floor(i / (2 * rows))].top ? top : beam;
        colours.setXYZ(i, paint.r, paint.g, paint.b);
      }
      colours.needsUpdate = true;
    });
    const mesh = new Mesh(this.geometry, new MeshStandardMaterial({ vertexColors: true, roughness: 0.45, side: DoubleSide }));
    mesh.castShadow = mesh.receiveShadow = true;
    // Its bounds change with every frame; it is where the robot is.
    mesh.frustumCulled = false;
    return mesh;
  }

  /** Bends with a sampled state. */
  pose(run, state) {
    const { first, front, lengths } = this.where;
    const last = this.stations.length - 1;
    for (const station of this.stations) station.position.set(0, 0, 0);
    // A station between two segments lies in the middle of their ends.
    for (let i = 0; i < this.segments; i++) {
      run.pose(state, first + i, place, turn);
      for (const [row, x] of [[i, this.half], [i + 1, -this.half]]) {
        const { position, orientation } = this.stations[row];
        position.addScaledVector(along(turn, x).add(place), 0.5);
        if (row === i + 1) orientation.copy(turn);
        else orientation.slerp(turn, 0.5);
      }
    }
    // The first and the last lie on the modules' faces.
    for (const [row, part, x] of [[0, front, -0.5 * lengths[0]], [last, front + 1, 0.5 * lengths[1]]]) {
      run.pose(state, part, place, turn);
      this.stations[row].position.copy(along(turn, x).add(place));
      this.stations[row].orientation.copy(turn).multiply(this.roll);
    }
    this.#write();
  }

  #write() {
    const { position, normal } = this.geometry.attributes;
    let at = 0;
    for (const edge of this.edges) {
      for (const station of this.stations) {
        place.copy(edge.normal).applyQuaternion(station.orientation);
        for (const end of edge.ends) {
          const point = offset.copy(end).applyQuaternion(station.orientation).add(station.position);
          position.setXYZ(at, point.x, point.y, point.z);
          normal.setXYZ(at, place.x, place.y, place.z);
          at += 1;
        }
      }
    }
    position.needsUpdate = normal.needsUpdate = true;
  }
}

const offset = new Vector3();

/** The part's x axis, `x` mm long. */
function along(orientation, x) {
  return offset.set(x, 0, 0).applyQuaternion(orientation);
}
