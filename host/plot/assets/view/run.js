// The run as the page holds it: numbers out of the codes, and the state between two frames.

import { Body } from "view/body";

/** Reads what `host/plot/src/view/scene.rs` wrote. */
export function readRun(text) {
  return new Run(JSON.parse(text));
}

function decode(json, isLength) {
  const channels = json.scale.length;
  const values = new Float64Array(json.frames * channels);
  const digit = (at) => {
    const code = json.codes.charCodeAt(at);
    return code < 58 ? code - 48 : code - 87;
  };
  for (let i = 0; i < values.length; i++) {
    const at = 4 * i;
    const code = (digit(at) << 4) | digit(at + 1) | (digit(at + 2) << 12) | (digit(at + 3) << 8);
    const [least, step] = json.scale[i % channels];
    values[i] = (least + step * code) * (isLength(i % channels) ? 1000 : 1);
  }
  return values;
}

class Run extends Body {
  constructor(json) {
    super(json.plan, json.scale.length);
    Object.assign(this, { title: json.title, speeds: json.speeds, frames: json.frames });
    this.start = json.start_s;
    this.interval = json.interval_s;
    this.end = this.start + this.interval * Math.max(json.frames - 1, 0);
    this.values = decode(json, (channel) => this.isLength(channel));
    this.#summarise();
  }

  /** Of every frame: centroid, heading; and of the whole run: the rotor's turn. */
  #summarise() {
    this.centroids = [];
    this.headings = new Float64Array(this.frames);
    for (let frame = 0; frame < this.frames; frame++) {
      const state = this.values.subarray(frame * this.channels, (frame + 1) * this.channels);
      this.centroids.push(this.centroidOf(state));
      const heading = this.headingOf(state);
      const before = frame ? this.headings[frame - 1] : heading;
      this.headings[frame] = heading - 2 * Math.PI * Math.round((heading - before) / (2 * Math.PI));
    }
    const span = this.end - this.start;
    const turns = this.rotor === null ? 0 : Math.abs(this.angle(this.frames - 1) - this.angle(0)) / (2 * Math.PI);
    // The time over which what shakes is averaged, s.
    this.turn = turns >= 1 ? Math.min(span / turns, 0.5) : Math.min(0.15, span);
  }

  /** The force on a foot that one in a hundred exceeds, of those that touch, N. */
  get largeForce() {
    const forces = [];
    for (let frame = 0; frame < this.frames; frame++) {
      for (let foot = 0; foot < this.feet; foot++) {
        const at = frame * this.channels + this.poses + 3 * foot;
        if (this.values[at + 2] > 0) forces.push(Math.hypot(...this.values.subarray(at, at + 3)));
      }
    }
    return forces.sort((a, b) => a - b)[Math.floor(0.99 * forces.length)] ?? 0;
  }

  angle(frame) {
    return this.values[frame * this.channels + this.rotor];
  }

  /** All channels at a time, into `out`: cubic between frames, linear for the forces, whose corners are real. */
  sample(time, out) {
    const place = this.#place(time);
    const { channels, values } = this;
    const row = (frame) => Math.min(Math.max(frame, 0), this.frames - 1) * channels;
    const [before, from, to, after] = [row(place.frame - 1), row(place.frame), row(place.frame + 1), row(place.frame + 2)];
    const t = place.share;
    for (let i = 0; i < channels; i++) {
      const [a, b, c, d] = [values[before + i], values[from + i], values[to + i], values[after + i]];
      const force = i >= this.poses && i < this.poses + 3 * this.feet;
      out[i] = force ? b + t * (c - b) : b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
    }
    return out;
  }

  #place(time) {
    const at = this.interval > 0 ? Math.min(Math.max((time - this.start) / this.interval, 0), this.frames - 1) : 0;
    const frame = Math.min(Math.floor(at), Math.max(this.frames - 2, 0));
    return { frame, share: at - frame };
  }

  /** Whether the ground carries a foot at the frame nearest to a time. */
  touches(time, foot) {
    const { frame, share } = this.#place(time);
    return this.touchesAt(Math.min(frame + Math.round(share), this.frames - 1), foot);
  }

  touchesAt(frame, foot) {
    return this.values[frame * this.channels + this.poses + 3 * foot + 2] > 0;
  }

  /** Centroid and heading at a time. */
  centroid(time) {
    const { frame, share } = this.#place(time);
    const [a, b] = [this.centroids[frame], this.centroids[Math.min(frame + 1, this.frames - 1)]];
    return a.map((value, axis) => value + share * (b[axis] - value));
  }

  heading(time) {
    const { frame, share } = this.#place(time);
    const next = this.headings[Math.min(frame + 1, this.frames - 1)];
    return this.headings[frame] + share * (next - this.headings[frame]);
  }

  /** The centroid without the shaking: its mean over a turn about a time. */
  calmCentroid(time) {
    const samples = 16;
    const mean = [0, 0, 0];
    for (let i = 0; i < samples; i++) {
      const point = this.centroid(time + this.turn * ((i + 0.5) / samples - 0.5));
      for (let axis = 0; axis < 3; axis++) mean[axis] += point[axis] / samples;
    }
    return mean;
  }

  /** Of the rotor, Hz, clockwise positive: its mean over a turn about a time. */
  frequency(time) {
    const samples = 16;
    let sum = 0;
    for (let i = 0; i < samples; i++) {
      const { frame, share } = this.#place(time + this.turn * ((i + 0.5) / samples - 0.5));
      sum += this.values[Math.min(frame + Math.round(share), this.frames - 1) * this.channels + this.rotor + 1];
    }
    return sum / samples;
  }

  /** Mean speeds over the turn before a time, in the frame of the start: mm/s, mm/s, °/s; null at the start. */
  speedsBefore(time) {
    const from = Math.max(time - this.turn, this.start);
    const span = time - from;
    if (span < 0.5 * this.turn || span <= 0) return null;
    const [a, b] = [this.centroid(from), this.centroid(time)];
    const yaw = ((this.heading(time) - this.heading(from)) * 180) / Math.PI;
    return { longitudinal: (b[0] - a[0]) / span, lateral: (b[1] - a[1]) / span, yaw: yaw / span };
  }
}
