// Which foot touches when, as a strip over the whole run: a row a foot, from the front left one down.

import { footColour, onTheme } from "view/theme";

export function gait(canvas, run) {
  const draw = () => {
    const { clientWidth, clientHeight } = canvas;
    if (!clientWidth) return;
    const ratio = Math.min(devicePixelRatio, 2);
    canvas.width = Math.round(clientWidth * ratio);
    canvas.height = Math.round(clientHeight * ratio);
    const context = canvas.getContext("2d");
    const row = canvas.height / run.feet;
    const column = canvas.width / Math.max(run.frames - 1, 1);
    for (let foot = 0; foot < run.feet; foot++) {
      context.fillStyle = `#${footColour(foot).getHexString()}`;
      for (let frame = 0, from = null; frame <= run.frames; frame++) {
        const touches = frame < run.frames && run.touchesAt(frame, foot);
        if (touches && from === null) from = frame;
        if (!touches && from !== null) {
          context.fillRect((from - 0.5) * column, row * foot, (frame - from) * column, Math.max(row - ratio, 1));
          from = null;
        }
      }
    }
  };
  onTheme(draw);
  new ResizeObserver(draw).observe(canvas);
}
