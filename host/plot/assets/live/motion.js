// The motion as it comes: states a hundred times a second, shown a little late so that there is one on either side.

import { Body, POSE } from "view/body";

/** How far the picture is behind what came last, s: more than comes between two messages. */
const BEHIND_S = 0.12;
/** Farther off than this the picture leaps, s. */
const LEAP_S = 0.5;
const KEPT_S = 3;
/** Time over which shaking is averaged, s: about a turn of the rotor. */
const CALM_S = 0.15;

export class Motion extends Body {
  /** `rest`: the state before anything is known, in metres. */
  constructor(plan, rest) {
    super(plan, rest.length);
    this.rest = rest.map((value, channel) => (this.isLength(channel) ? 1000 * value : value));
    this.state = Float64Array.from(this.rest);
    this.frames = [{ t: 0, state: this.rest }];
    this.time = null;
    this.calm = this.centroidOf(this.rest);
    this.heading = 0;
    /** Calm centroids and headings of the last second, for speeds. */
    this.past = [];
    // What the ground is drawn around, and how large the arrows are.
    this.centroids = [this.calm];
    this.largeForce = 0;
  }

  /** A state in metres. */
  add(t, values) {
    const before = this.frames.at(-1).state;
    const state = values.map((value, channel) => (this.isLength(channel) ? 1000 * value : value));
    // q and −q are the same orientation: the one that is nearer to the state before can be interpolated.
    for (let at = 3; at < this.poses; at += POSE) {
      if (state[at] * before[at] + state[at + 1] * before[at + 1] + state[at + 2] * before[at + 2] + state[at + 3] * before[at + 3] >= 0) continue;
      for (let i = at; i < at + 4; i++) state[i] = -state[i];
    }
    this.#push(t, state);
  }

  /** Where the body is not known: the rotor's angle, deg, wrapped, and frequency, Hz. */
  turn(t, angle, frequency) {
    const state = Array.from(this.rest);
    const [before, now] = [this.frames.at(-1).state[this.rotor], (angle * Math.PI) / 180];
    state[this.rotor] = now + 2 * Math.PI * Math.round((before - now) / (2 * Math.PI));
    state[this.rotor + 1] = frequency;
    this.#push(t, state);
  }

  #push(t, state) {
    // The simulation has begun again.
    if (t < this.frames.at(-1).t) this.frames.length = 0;
    this.frames.push({ t, state });
    while (this.frames.length > 2 && this.frames[1].t < t - KEPT_S) this.frames.shift();
  }

  /** Moves the picture on by `passed` s; whether it changed. */
  advance(passed) {
    const goal = this.frames.at(-1).t - BEHIND_S;
    if (this.time === null || Math.abs(goal - this.time) > LEAP_S) this.time = goal;
    // Two clocks are never the same: what is off goes away in half a second.
    else this.time += passed + (goal - this.time - passed) * Math.min(1, 2 * passed);
    this.#sample();
    this.#calm(passed);
  }

  #sample() {
    const { frames, time } = this;
    let next = frames.findLastIndex((frame) => frame.t <= time) + 1;
    next = Math.min(Math.max(next, Math.min(1, frames.length - 1)), frames.length - 1);
    const [from, to] = [frames[Math.max(next - 1, 0)], frames[next]];
    const share = to.t > from.t ? Math.min(Math.max((time - from.t) / (to.t - from.t), 0), 1) : 1;
    for (let i = 0; i < this.channels; i++) this.state[i] = from.state[i] + share * (to.state[i] - from.state[i]);
  }

  #calm(passed) {
    const share = 1 - Math.exp(-passed / CALM_S);
    const [now, heading] = [this.centroidOf(this.state), this.headingOf(this.state)];
    const away = Math.hypot(now[0] - this.calm[0], now[1] - this.calm[1]);
    // Set down elsewhere.
    if (away > 50) this.past.length = 0;
    for (let axis = 0; axis < 3; axis++) this.calm[axis] += (away > 50 ? 1 : share) * (now[axis] - this.calm[axis]);
    const turned = heading - this.heading;
    this.heading += share * (turned - 2 * Math.PI * Math.round(turned / (2 * Math.PI)));
    this.past.push({ t: this.time, x: this.calm[0], y: this.calm[1], heading: this.heading });
    // The one before stays: a slow computer draws less than a picture a second.
    while (this.past.length > 2 && this.past[1].t < this.time - 1) this.past.shift();
  }

  touches(foot) {
    return this.state[this.poses + 3 * foot + 2] > 0;
  }

  /** Over the last second: mm/s ahead and to the left, °/s; null before there is half a second. */
  speeds() {
    const [from, to] = [this.past[0], this.past.at(-1)];
    const span = to ? to.t - from.t : 0;
    if (span < 0.5) return null;
    const [dx, dy] = [(to.x - from.x) / span, (to.y - from.y) / span];
    const [cos, sin] = [Math.cos(from.heading), Math.sin(from.heading)];
    return { ahead: dx * cos + dy * sin, left: dy * cos - dx * sin, yaw: ((to.heading - from.heading) * 180) / Math.PI / span };
  }
}
