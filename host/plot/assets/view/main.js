// The page: time runs, everything else follows it.

import { Forces } from "view/forces";
import { gait } from "view/gait";
import { ground } from "view/ground";
import { Panel } from "view/panel";
import { Robot } from "view/robot";
import { readRun } from "view/run";
import { Stage } from "view/stage";
import { onTheme } from "view/theme";
import { Traces } from "view/traces";
import { walls } from "view/walls";

const run = readRun(document.getElementById("run").textContent);

function start() {
  const length = 1000 * run.plan.modules.reduce((sum, module, k) => sum + module.size[0] + (run.plan.backbones[k]?.length ?? 0), 0);
  const stage = new Stage(document.getElementById("canvas"), length, run.plan.gravity);
  const [robot, traces, forces] = [new Robot(run), new Traces(run), new Forces(run)];
  stage.world.add(ground(run), walls(run), robot.group, traces.group, forces.group);
  gait(document.getElementById("gait"), run);

  const state = new Float64Array(run.channels);
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  let [time, playing, before] = [run.start, !still && run.end > run.start, null];
  const panel = new Panel(run, { play, seek, view, show });
  panel.playing(playing);
  stage.view("start", run.calmCentroid(time), run.heading(time));
  show();
  onTheme(() => (stage.stale = true));
  // A page that was hidden goes on where it stood.
  document.addEventListener("visibilitychange", () => (before = null));
  requestAnimationFrame(tick);

  function play() {
    playing = !playing && run.end > run.start;
    if (playing && time >= run.end) time = run.start;
    before = null;
    panel.playing(playing);
  }

  function seek(to) {
    time = Math.min(Math.max(to, run.start), run.end);
    place();
  }

  function view(name) {
    stage.view(name, run.calmCentroid(time), run.heading(time));
  }

  function show() {
    traces.group.visible = panel.checked("traces");
    forces.group.visible = panel.checked("forces");
    if (robot.rotor) robot.rotor.visible = panel.checked("rotor");
    panel.legend(panel.checked("forces") && run.plan.contact ? forces.legend : null);
    place();
  }

  /** Puts everything where it is at `time`. */
  function place() {
    run.sample(time, state);
    robot.pose(state);
    forces.pose(state);
    traces.until(time);
    stage.moveTo(run.calmCentroid(time), panel.checked("follow"));
    panel.tell(time);
    stage.stale = true;
  }

  function tick(now) {
    if (playing) {
      const passed = before === null ? 0 : Math.min((now - before) / 1000, 1);
      before = now;
      time += passed * panel.rate;
      if (time > run.end) time = run.start;
      place();
    }
    if (stage.stale) stage.render();
    requestAnimationFrame(tick);
  }
}

function fail(message) {
  Object.assign(document.getElementById("failure"), { hidden: false, textContent: message });
}

if (run.frames === 0) {
  fail("This run has no snapshots: there is nothing to show.");
} else {
  try {
    start();
  } catch (error) {
    fail(`The picture needs WebGL 2, which this browser does not give: ${error.message}`);
    throw error;
  }
}
