// What is written beside the picture.

import { frequency, signed } from "view/words";

const by = (id) => document.getElementById(id);
const LINES = 200;

export function tellRobot(robot, latest) {
  by("name").textContent = robot.name;
  const state = by("state");
  state.textContent = !robot.present ? "not heard" : (robot.state ?? "here");
  state.classList.toggle("fault", robot.is_fault);
  state.classList.toggle("driving", robot.present && !robot.is_fault && robot.target !== null);
  by("target").textContent = robot.target ?? "";
  by("fault").hidden = !robot.is_fault;
  by("fault").textContent = robot.is_fault ? `${robot.fault}: ${robot.advice}` : "";
  by("rotor-hz").textContent = latest.frequency_hz === undefined || !robot.present ? "–" : frequency(latest.frequency_hz);
  by("duty").textContent = latest.duty === undefined || !robot.present ? "–" : `${signed(100 * latest.duty, 0)} %`;
  by("battery").textContent = robot.battery_v === null ? "–" : `${robot.battery_v.toFixed(2)} V`;
  by("link").textContent = robot.present ? link(robot) : "–";
}

function link({ rate_hz, loss, round_trip_ms }) {
  const parts = [`${rate_hz.toFixed(0)}/s`, `${(100 * (loss ?? 0)).toFixed(1)} % lost`];
  if (round_trip_ms !== null) parts.push(`${round_trip_ms.toFixed(1)} ms`);
  return parts.join(", ");
}

export function tellSpeeds(speeds) {
  by("speed").textContent = speeds ? `${signed(speeds.ahead, 1)} / ${signed(speeds.left, 1)} mm/s` : "–";
  by("yaw").textContent = speeds ? `${signed(speeds.yaw, 1)} °/s` : "–";
}

export function tellRecording(recording) {
  if (!recording) return;
  const text = `${recording.path}, ${(recording.bytes / 1e6).toFixed(1)} MB`;
  by("recording").textContent = recording.failed ? `not recorded any more: ${recording.failed}` : `recording: ${text}`;
}

export function say(text, isBad = false) {
  by("said").textContent = text;
  by("said").classList.toggle("bad", isBad);
}

export function log(lines, anew) {
  const list = by("log");
  if (anew) list.textContent = "";
  const box = list.parentElement;
  const atEnd = box.scrollHeight - box.scrollTop - box.clientHeight < 20;
  for (const { t_s, robot, level, text } of lines) {
    const item = document.createElement("li");
    const time = Object.assign(document.createElement("time"), { textContent: t_s.toFixed(2) });
    const words = Object.assign(document.createElement("span"), { className: level, textContent: robot ? `${robot}: ${text}` : text });
    item.append(time, words);
    list.append(item);
  }
  while (list.childElementCount > LINES) list.firstElementChild.remove();
  if (lines.length && atEnd) box.scrollTop = box.scrollHeight;
}
