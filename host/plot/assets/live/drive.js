// What a person does: drive, stop, look from elsewhere.

import { signed } from "view/words";

const by = (id) => document.getElementById(id);

export class Drive {
  /** `act`: command(text), stop(), view(name), show() when a box has changed. */
  constructor(setup, act) {
    this.act = act;
    this.typed = [];
    by("mode").textContent = setup.drive ? "may drive" : "looks on";
    by("mode").title = setup.drive ? "Closing or hiding this page stops the robots" : "Started without --drive: no command is taken";
    for (const button of document.querySelectorAll("[data-view]")) button.addEventListener("click", () => act.view(button.dataset.view));
    for (const id of ["follow", "forces"]) by(id).addEventListener("change", () => act.show());
    by("panel").addEventListener("submit", (event) => event.preventDefault());
    by("drive").hidden = !setup.drive;
    if (setup.drive) this.#driving(setup.frequency_limit_hz);
  }

  #driving(limit) {
    const slider = by("frequency");
    Object.assign(slider, { min: -limit, max: limit });
    slider.value = Math.min(7, limit);
    const hertz = () => `${signed(Number(slider.value), 1)} Hz`;
    const tell = () => (by("frequency-hz").textContent = hertz());
    slider.addEventListener("input", tell);
    tell();
    by("go").addEventListener("click", () => this.act.command(`freq ${slider.value}`));
    by("stop").addEventListener("click", () => this.act.stop());
    for (const button of document.querySelectorAll("[data-command]")) button.addEventListener("click", () => this.act.command(button.dataset.command));
    // Wherever the person is on the page.
    addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      event.preventDefault();
      this.act.stop();
    }, { capture: true });
    by("command").addEventListener("keydown", (event) => this.#type(event));
  }

  #type(event) {
    const line = by("command");
    if (event.key === "Enter" && line.value.trim()) {
      this.typed.push(line.value);
      this.back = this.typed.length;
      this.act.command(line.value);
      line.value = "";
    } else if (event.key === "ArrowUp" || event.key === "ArrowDown") {
      event.preventDefault();
      this.back = Math.min(Math.max((this.back ?? 0) + (event.key === "ArrowUp" ? -1 : 1), 0), this.typed.length);
      line.value = this.typed[this.back] ?? "";
    }
  }
}
