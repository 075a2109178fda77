// A curve of the last half minute.

const LEFT = 34;
const PAD = 6;

export class Plot {
  /** `angle`: of values that wrap at ±180, which are dots. `range`: what is always seen. */
  constructor(parent, { title, unit, digits, range, angle = false }) {
    Object.assign(this, { unit, digits, range, angle, points: [], stale: true });
    const figure = document.createElement("figure");
    figure.innerHTML = `<figcaption><span></span><output>–</output></figcaption><canvas role="img"></canvas>`;
    figure.querySelector("span").textContent = title;
    [this.value, this.canvas] = [figure.querySelector("output"), figure.querySelector("canvas")];
    this.canvas.setAttribute("aria-label", title);
    figure.hidden = true;
    parent.append(figure);
    this.figure = figure;
    new ResizeObserver(() => (this.stale = true)).observe(this.canvas);
  }

  add(points, span) {
    if (points.length === 0) return;
    this.figure.hidden = false;
    this.points.push(...points);
    const last = this.points.at(-1)[0];
    const gone = this.points.findIndex(([t]) => t >= last - span);
    if (gone > 0) this.points.splice(0, gone);
    this.stale = true;
  }

  clear() {
    this.points = [];
    this.stale = true;
  }

  /** Draws the `span` s up to `now`. */
  draw(now, span) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (this.figure.hidden || !width) return;
    const latest = this.points.at(-1);
    this.value.textContent = latest ? `${latest[1].toFixed(this.digits)} ${this.unit}`.replace("-", "−") : "–";
    const ratio = Math.min(devicePixelRatio, 2);
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      Object.assign(this.canvas, { width: Math.round(width * ratio), height: Math.round(height * ratio) });
    }
    const context = this.canvas.getContext("2d");
    const css = getComputedStyle(this.canvas);
    const ink = (name) => css.getPropertyValue(`--${name}`).trim();
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    const [low, high] = this.#bounds();
    const x = (t) => LEFT + ((t - now + span) / span) * (width - LEFT - 2);
    const y = (value) => PAD + ((high - value) / (high - low)) * (height - 2 * PAD);
    context.font = `10px ${css.fontFamily}`;
    context.textAlign = "right";
    context.textBaseline = "middle";
    context.lineWidth = 1;
    for (const value of marks(low, high)) {
      context.strokeStyle = ink("grid");
      context.beginPath();
      context.moveTo(LEFT, y(value));
      context.lineTo(width, y(value));
      context.stroke();
      context.fillStyle = ink("soft");
      context.fillText(String(value).replace("-", "−"), LEFT - 5, y(value));
    }
    context.save();
    context.beginPath();
    context.rect(LEFT, 0, width - LEFT, height);
    context.clip();
    context.fillStyle = context.strokeStyle = ink("accent");
    if (this.angle) {
      for (const [t, value] of this.points) context.fillRect(x(t) - 0.7, y(value) - 0.7, 1.4, 1.4);
    } else {
      context.lineWidth = 1.6;
      context.lineJoin = "round";
      context.beginPath();
      for (const [i, [t, value]] of this.points.entries()) {
        // A hole in what was heard is one in the curve.
        if (i === 0 || t - this.points[i - 1][0] > 0.5) context.moveTo(x(t), y(value));
        else context.lineTo(x(t), y(value));
      }
      context.stroke();
    }
    context.restore();
    this.stale = false;
  }

  #bounds() {
    let [low, high] = this.range;
    if (this.angle) return [low, high];
    for (const [, value] of this.points) {
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
    const margin = 0.05 * (high - low || 1);
    return [low - margin, high + margin];
  }
}

/** Two to four round values. */
function marks(low, high) {
  const rough = (high - low) / 3;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 2.5, 5, 10, 20].map((digit) => digit * power).find((step) => (high - low) / step <= 4);
  const found = [];
  for (let k = Math.ceil(low / step); k * step <= high; k++) found.push(Number((k * step).toPrecision(6)));
  return found.includes(-180) || high !== 180 ? found : [-180, 0, 180];
}
