// The page: what comes is kept, and drawn with every picture that the browser makes.

import { Drive } from "live/drive";
import { Line } from "live/line";
import { Plot } from "live/plot";
import { log, say, tellRecording, tellRobot, tellSpeeds } from "live/readout";
import { LiveScene } from "live/scene";

const by = (id) => document.getElementById(id);
const setup = JSON.parse(by("setup").textContent);
const plots = {
  frequency_hz: new Plot(by("plots"), { title: "Frequency", unit: "Hz", digits: 2, range: [-1, 1] }),
  duty: new Plot(by("plots"), { title: "Duty", unit: "", digits: 2, range: [-1, 1] }),
  angle_deg: new Plot(by("plots"), { title: "Shaft angle", unit: "°", digits: 0, range: [-180, 180], angle: true }),
  battery_v: new Plot(by("plots"), { title: "Battery", unit: "V", digits: 2, range: [3.4, 4.2] }),
};
const latest = {};
let [scene, span, now, selected, before] = [null, 30, 0, 0, null];

function take(points) {
  if (!points) return;
  for (const [name, plot] of Object.entries(plots)) {
    plot.add(points[name], span);
    latest[name] = points[name].at(-1)?.[1] ?? latest[name];
  }
}

function told(message) {
  if (message.kind === "refused") return say(message.text, true);
  if (message.kind === "all") {
    span = message.plotted_s;
    for (const plot of Object.values(plots)) plot.clear();
    take(message.points);
    return log(message.log, true);
  }
  if (selected !== message.selected) for (const plot of Object.values(plots)) plot.clear();
  [now, selected] = [message.t_s, message.selected];
  take(message.points);
  scene?.take(message.body, message.points);
  const robot = message.robots[selected];
  if (robot) tellRobot(robot, latest);
  tellRecording(message.recording);
  log(message.log, false);
}

const line = new Line({
  told,
  open(isOpen) {
    say(isOpen ? "" : "the console is gone: its robots stop by themselves", !isOpen);
    if (!isOpen) by("state").textContent = "not connected";
  },
});

new Drive(setup, {
  command(text) {
    say("");
    line.command(text);
  },
  stop: () => line.stop(),
  view: (name) => scene?.view(name),
  show: () => scene?.show(),
});

if (setup.plan === null) by("knows").textContent = "The robot file has no body to draw.";
else if (!setup.moves) by("knows").textContent = "A robot tells how its shaft turns; where its body is, nobody measures.";
for (const id of ["speed", "yaw"]) by(id).closest("div").hidden = !setup.moves;
if (setup.plan === null) {
  by("legend").textContent = "";
} else {
  try {
    scene = new LiveScene(setup);
  } catch (error) {
    Object.assign(by("failure"), { hidden: false, textContent: `The picture needs WebGL 2, which this browser does not give: ${error.message}` });
  }
}

requestAnimationFrame(draw);

function draw(at) {
  const passed = before === null ? 0 : Math.min((at - before) / 1000, 1);
  before = at;
  now += passed;
  scene?.draw(passed);
  if (setup.moves) tellSpeeds(scene?.motion.speeds() ?? null);
  for (const plot of Object.values(plots)) plot.draw(now, span);
  requestAnimationFrame(draw);
}
