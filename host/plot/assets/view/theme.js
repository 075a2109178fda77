// Colours: the style sheet's, which knows the reader's scheme, and one for each foot.

import { Color } from "three";

const dark = matchMedia("(prefers-color-scheme: dark)");

/** A colour of the style sheet by its name there. */
export function colour(name) {
  return new Color(getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());
}

/** A module's hue, its left foot deep and its right foot light, or the other way round on a dark ground. */
export function footColour(foot) {
  const hues = [212, 22, 150, 300, 48, 185];
  const module = foot >> 1;
  const hue = module < hues.length ? hues[module] : (module * 137.5) % 360;
  const left = foot % 2 === 0;
  const lightness = dark.matches ? (left ? 52 : 74) : left ? 38 : 60;
  return new Color(`hsl(${hue}, ${left ? 85 : 75}%, ${lightness}%)`);
}

/** Calls back now, and whenever the reader's scheme changes. */
export function onTheme(callback) {
  callback();
  dark.addEventListener("change", callback);
}

/** A canvas of `width` × `height` pixels, drawn by `draw(context)`. */
export function drawn(width, height, draw) {
  const canvas = Object.assign(document.createElement("canvas"), { width, height });
  draw(canvas.getContext("2d"));
  return canvas;
}
