// Which feet touch: a box a module and a dot a foot, seen from above, the front to the right as the robot starts.

import { footColour, onTheme } from "view/theme";

export class Feet {
  constructor(element, { modules, feet }) {
    const pitch = Math.min(26, 150 / modules);
    const x = (foot) => 24 + pitch * (modules - 1 - (foot >> 1)) + 0.5 * pitch;
    const dots = Array.from({ length: feet }, (_, foot) => `<circle cx="${x(foot)}" cy="${foot % 2 ? 38 : 8}" r="${0.23 * pitch}" stroke-width="1.6"/>`);
    const boxes = Array.from({ length: modules }, (_, k) => `<rect x="${x(2 * k) - 0.3 * pitch}" y="16.5" width="${0.6 * pitch}" height="13" rx="2"/>`);
    const spine = `<line x1="${x(feet - 1)}" x2="${x(0)}" y1="23" y2="23"/>`;
    const width = 24 + pitch * modules + 34;
    element.innerHTML = `<svg viewBox="0 0 ${width} 46">${spine}${boxes.join("")}${dots.join("")}
      <text x="0" y="11">left</text><text x="0" y="41">right</text><text x="${width - 30}" y="26">front</text></svg>`;
    this.dots = [...element.querySelectorAll("circle")];
    onTheme(() => this.dots.forEach((dot, foot) => dot.setAttribute("stroke", `#${footColour(foot).getHexString()}`)));
  }

  /** Fills the dots of the feet that touch. */
  show(touches) {
    this.dots.forEach((dot, foot) => dot.setAttribute("fill", touches(foot) ? dot.getAttribute("stroke") : "transparent"));
  }
}
