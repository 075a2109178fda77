// Buttons, slider, keys, and what is written beside the picture.

import { footColour, onTheme } from "view/theme";

const by = (id) => document.getElementById(id);
const PLAY = "M8 5v14l11-7z";
const PAUSE = "M7 5h4v14H7zM13 5h4v14h-4z";
const STEP_S = 0.005;

export class Panel {
  /** `act`: play(), seek(time), view(name), show() when a box has changed. */
  constructor(run, act) {
    this.run = run;
    this.act = act;
    this.time = run.start;
    this.#slider();
    by("play").addEventListener("click", () => act.play());
    for (const button of document.querySelectorAll("[data-view]")) {
      button.addEventListener("click", () => act.view(button.dataset.view));
    }
    for (const id of ["follow", "traces", "forces", "rotor"]) by(id).addEventListener("change", () => act.show());
    addEventListener("keydown", (event) => this.#key(event));
    by("speeds").textContent = meanSpeeds(run.speeds);
    // A robot that is held fast goes nowhere.
    for (const id of ["longitudinal", "lateral", "yaw"]) by(id).closest("div").hidden = run.plan.clamped !== null;
    by("rotor-row").hidden = run.rotor === null;
    by("rotor").closest("label").hidden = run.rotor === null;
    this.#feet();
  }

  #slider() {
    const slider = by("slider");
    Object.assign(slider, { min: this.run.start, max: this.run.end, value: this.run.start });
    slider.addEventListener("input", () => this.act.seek(Number(slider.value)));
    const strip = by("gait");
    const point = (event) => {
      if (event.buttons !== 1) return;
      strip.setPointerCapture(event.pointerId);
      this.act.seek(this.run.start + (event.offsetX / strip.clientWidth) * (this.run.end - this.run.start));
    };
    strip.addEventListener("pointerdown", point);
    strip.addEventListener("pointermove", point);
  }

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const step = event.shiftKey ? 10 * STEP_S : STEP_S;
    const press = (id) => () => by(id).click();
    const view = (name) => () => this.act.view(name);
    const rate = (i) => () => document.querySelectorAll("[name=rate]")[i].click();
    const keys = {
      " ": () => this.act.play(),
      arrowleft: () => this.act.seek(this.time - step),
      arrowright: () => this.act.seek(this.time + step),
      home: () => this.act.seek(this.run.start),
      end: () => this.act.seek(this.run.end),
      1: rate(0), 2: rate(1), 3: rate(2), 4: rate(3),
      a: view("above"), s: view("side"), b: view("behind"),
      f: press("follow"), t: press("traces"), c: press("forces"), r: press("rotor"),
    };
    const action = keys[event.key.toLowerCase()];
    if (!action) return;
    // Space would also press the button that has the focus, and arrows change the chosen speed.
    event.preventDefault();
    action();
  }

  /** A box a foot, seen from above, the front to the right as the robot starts. */
  #feet() {
    const { modules, feet } = this.run;
    const pitch = Math.min(26, 150 / modules);
    const x = (foot) => 24 + pitch * (modules - 1 - (foot >> 1)) + 0.5 * pitch;
    const dots = Array.from({ length: feet }, (_, foot) => `<circle cx="${x(foot)}" cy="${foot % 2 ? 38 : 8}" r="${0.23 * pitch}" stroke-width="1.6"/>`);
    const boxes = Array.from({ length: modules }, (_, k) => `<rect x="${x(2 * k) - 0.3 * pitch}" y="16.5" width="${0.6 * pitch}" height="13" rx="2"/>`);
    const spine = `<line x1="${x(feet - 1)}" x2="${x(0)}" y1="23" y2="23"/>`;
    const width = 24 + pitch * modules + 34;
    by("feet").innerHTML = `<svg viewBox="0 0 ${width} 46">${spine}${boxes.join("")}${dots.join("")}
      <text x="0" y="11">left</text><text x="0" y="41">right</text><text x="${width - 30}" y="26">front</text></svg>`;
    this.dots = [...by("feet").querySelectorAll("circle")];
    onTheme(() => this.dots.forEach((dot, foot) => dot.setAttribute("stroke", `#${footColour(foot).getHexString()}`)));
  }

  get rate() {
    return Number(document.querySelector("[name=rate]:checked").value);
  }

  checked(id) {
    return by(id).checked;
  }

  playing(on) {
    by("play-shape").setAttribute("d", on ? PAUSE : PLAY);
    by("play").setAttribute("aria-label", on ? "Pause" : "Play");
  }

  legend(forces) {
    by("legend").innerHTML = forces ? `grid 10 mm · force <i>↑</i> ${forces.length} mm = ${forces.force}, at most ${forces.longest} mm` : "grid 10 mm";
  }

  /** Writes what is at a time. */
  tell(time) {
    const { run } = this;
    this.time = time;
    by("slider").value = time;
    by("slider").setAttribute("aria-valuetext", `${time.toFixed(3)} seconds`);
    by("slider").style.setProperty("--done", run.end > run.start ? (time - run.start) / (run.end - run.start) : 0);
    by("time").textContent = `${time.toFixed(3)} s`;
    if (run.rotor !== null) by("rotor-hz").textContent = frequency(run.frequency(time));
    const speeds = run.speedsBefore(time);
    by("longitudinal").textContent = speeds ? `${signed(speeds.longitudinal, 1)} mm/s` : "–";
    by("lateral").textContent = speeds ? `${signed(speeds.lateral, 1)} mm/s` : "–";
    by("yaw").textContent = speeds ? `${signed(speeds.yaw, 1)} °/s` : "–";
    this.dots.forEach((dot, foot) => dot.setAttribute("fill", run.touches(time, foot) ? dot.getAttribute("stroke") : "transparent"));
  }
}

function signed(value, digits) {
  const text = Math.abs(value).toFixed(digits);
  return (value < 0 && Number(text) !== 0 ? "−" : "+") + text;
}

function frequency(hz) {
  const text = `${signed(hz, 2)} Hz`;
  return Math.abs(hz) < 0.005 ? text : `${text} ${hz > 0 ? "↻" : "↺"}`;
}

function meanSpeeds(speeds) {
  if (!speeds) return "";
  const number = (value) => Number(value.toFixed(2));
  const degrees = (speeds.yaw * 180) / Math.PI;
  return `mean of ${number(speeds.from_s)} … ${number(speeds.to_s)} s: ${signed(1000 * speeds.longitudinal, 1)} along, ${signed(1000 * speeds.lateral, 1)} mm/s to the left, ${signed(degrees, 1)} °/s`;
}
