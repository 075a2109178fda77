// Buttons, slider, keys, and what is written beside the picture.

import { Feet } from "view/feet";
import { frequency, legend, signed } from "view/words";

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
    this.feet = new Feet(by("feet"), run);
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
    by("legend").innerHTML = legend(forces);
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
    this.feet.show((foot) => run.touches(time, foot));
  }
}

function meanSpeeds(speeds) {
  if (!speeds) return "";
  const number = (value) => Number(value.toFixed(2));
  const degrees = (speeds.yaw * 180) / Math.PI;
  return `mean of ${number(speeds.from_s)} … ${number(speeds.to_s)} s: ${signed(1000 * speeds.longitudinal, 1)} along, ${signed(1000 * speeds.lateral, 1)} mm/s to the left, ${signed(degrees, 1)} °/s`;
}
