// The ground: strips along x that differ in height or friction, with a grid in centimetres.

import {
  BufferAttribute, BufferGeometry, CanvasTexture, DoubleSide, Group, Mesh, MeshBasicMaterial, MeshLambertMaterial, PlaneGeometry,
  RepeatWrapping, SRGBColorSpace,
} from "three";
import { colour, drawn, onTheme } from "view/theme";

/** How far the ground reaches beyond the robot's path, mm. */
const MARGIN = 3000;
const TILE = 100;
const PIXELS = 1024;

/** Strips from x to x, mm, with the height in mm and the factor on the friction. */
function strips(contact, [from, to]) {
  const steps = contact?.steps ?? [];
  const patches = contact?.patches ?? [];
  const edges = [...steps, ...patches].map(([x]) => 1000 * x).filter((x) => x > from && x < to);
  const bounds = [from, ...new Set(edges.sort((a, b) => a - b)), to];
  // A list says what holds from x on; before its first x, what holds everywhere.
  const at = (list, x, otherwise) => list.filter(([start]) => 1000 * start <= x + 1e-6).at(-1)?.[1] ?? otherwise;
  return bounds.slice(0, -1).map((x, i) => ({ from: x, to: bounds[i + 1], height: 1000 * at(steps, x, 0), factor: at(patches, x, 1) }));
}

/** The ground's height under x, mm. */
export function heightAt(contact, x) {
  return 1000 * ((contact?.steps ?? []).filter(([start]) => 1000 * start <= x).at(-1)?.[1] ?? 0);
}

export function ground(run) {
  const group = new Group();
  const contact = run.plan.contact;
  const range = (axis) => {
    const values = run.centroids.map((point) => point[axis]);
    return [Math.min(...values) - MARGIN, Math.max(...values) + MARGIN];
  };
  const [alongX, alongY] = [range(0), range(1)];
  const all = strips(contact, alongX);
  const textures = new Map(all.map(({ factor }) => [factor, gridTexture()]));
  const paint = [...textures].map(([factor, texture]) => () => drawGrid(texture, factor));
  for (const [i, strip] of all.entries()) {
    const corner = (x, y, z) => [x, y, z];
    const [y0, y1] = alongY;
    const top = quad(corner(strip.from, y0, strip.height), corner(strip.to, y0, strip.height), corner(strip.to, y1, strip.height), corner(strip.from, y1, strip.height));
    add(top, new MeshLambertMaterial({ map: textures.get(strip.factor), side: DoubleSide }));
    const before = all[i - 1]?.height ?? strip.height;
    if (before !== strip.height) {
      const x = strip.from;
      const riser = new MeshLambertMaterial({ side: DoubleSide });
      add(quad(corner(x, y0, before), corner(x, y1, before), corner(x, y1, strip.height), corner(x, y0, strip.height)), riser);
      paint.push(() => riser.color.copy(colour("grid-strong")));
    }
    if (i > 0) group.add(edge(strip, Math.max(before, strip.height), alongY));
    if (i > 0) group.add(label(words(strip, all[i - 1], contact), strip.from + 4, 60, strip.height, 9, "ink"));
  }
  for (const mark of marks(run)) group.add(label(mark.text, mark.x, mark.y, heightAt(contact, mark.x), 6, "soft"));
  onTheme(() => {
    for (const one of paint) one();
  });
  return group;

  function add(geometry, material) {
    const mesh = new Mesh(geometry, material);
    mesh.receiveShadow = true;
    group.add(mesh);
  }
}

function quad(a, b, c, d) {
  const geometry = new BufferGeometry();
  const corners = [a, b, c, d];
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(corners.flat()), 3));
  geometry.setAttribute("uv", new BufferAttribute(new Float32Array(corners.flatMap(([x, y]) => [x / TILE, y / TILE])), 2));
  geometry.setIndex([0, 1, 2, 0, 2, 3]);
  geometry.computeVertexNormals();
  return geometry;
}

/** A colour of the style sheet, towards that of slippery or rough ground. */
function tinted(name, factor) {
  const strength = factor === 1 ? 0 : Math.min(0.12 + 0.12 * Math.abs(Math.log2(Math.max(factor, 0.05))), 0.6);
  return `#${colour(name).lerp(colour(factor < 1 ? "slippery" : "rough"), strength).getHexString()}`;
}

function words(strip, before, contact) {
  const parts = [];
  if (strip.height !== before.height) parts.push(`${signed(strip.height)} mm`);
  if (strip.factor !== before.factor) parts.push(`friction ${(contact.friction * strip.factor).toFixed(2)}`);
  return parts.join(", ");
}

/** A line where a strip begins. */
function edge(strip, height, [y0, y1]) {
  const material = new MeshBasicMaterial({ polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -2 });
  onTheme(() => material.color.copy(colour("soft")));
  const mesh = new Mesh(new PlaneGeometry(0.7, y1 - y0), material);
  mesh.position.set(strip.from, 0.5 * (y0 + y1), height + 0.04);
  return mesh;
}

function signed(value) {
  return (value < 0 ? "−" : "+") + Math.abs(value).toFixed(1).replace(/\.0$/, "");
}

/** Distances along the axes through the start. */
function marks(run) {
  const reach = (axis) => run.centroids.reduce((most, point) => Math.max(most, Math.abs(point[axis])), 0);
  const marks = [];
  for (let k = 1; k <= Math.min(Math.ceil(reach(0) / 100) + 4, 40); k++) {
    for (const x of [100 * k, -100 * k]) marks.push({ text: `${x < 0 ? "−" : ""}${Math.abs(x)} mm`, x: x + 1.5, y: -5 });
  }
  for (let k = 1; k <= Math.min(Math.ceil(reach(1) / 100) + 3, 40); k++) {
    for (const y of [100 * k, -100 * k]) marks.push({ text: `${y < 0 ? "−" : ""}${Math.abs(y)} mm`, x: 1.5, y: y - 5 });
  }
  return marks;
}

/** Words lying on the ground, their left end at x, `size` mm high. */
function label(text, x, y, z, size, ink) {
  const width = 24 + 36 * text.length;
  const material = new MeshBasicMaterial({ transparent: true, depthWrite: false, polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -4 });
  onTheme(() => {
    material.map?.dispose();
    material.map = new CanvasTexture(
      drawn(width, 64, (context) => {
        context.font = "500 52px system-ui, sans-serif";
        context.textBaseline = "middle";
        context.fillStyle = `#${colour(ink).getHexString()}`;
        context.fillText(text, 4, 34);
      }),
    );
    material.map.colorSpace = SRGBColorSpace;
    material.map.anisotropy = 8;
  });
  const mesh = new Mesh(new PlaneGeometry((size * width) / 64, size), material);
  mesh.position.set(x + (0.5 * size * width) / 64, y, z + 0.05);
  return mesh;
}

function gridTexture() {
  const texture = new CanvasTexture(drawn(PIXELS, PIXELS, () => {}));
  Object.assign(texture, { wrapS: RepeatWrapping, wrapT: RepeatWrapping, anisotropy: 16, colorSpace: SRGBColorSpace });
  return texture;
}

/** Ten centimetres of ground: a line every centimetre, a stronger one every ten. */
function drawGrid(texture, factor) {
  const context = texture.image.getContext("2d");
  const css = (name) => tinted(name, factor);
  context.fillStyle = css("ground");
  context.fillRect(0, 0, PIXELS, PIXELS);
  for (let k = 1; k < 10; k++) line((k * PIXELS) / 10, 3, css("grid"));
  line(0, 10, css("grid-strong"));
  line(PIXELS, 10, css("grid-strong"));
  texture.needsUpdate = true;

  function line(at, width, style) {
    context.fillStyle = style;
    context.fillRect(at - width / 2, 0, width, PIXELS);
    context.fillRect(0, at - width / 2, PIXELS, width);
  }
}
