// Numbers and scales in words.

/** A number with its sign, −0 as +0. */
export function signed(value, digits) {
  const text = Math.abs(value).toFixed(digits);
  return (value < 0 && Number(text) !== 0 ? "−" : "+") + text;
}

/** A frequency, and which way round that is seen from above. */
export function frequency(hz) {
  const text = `${signed(hz, 2)} Hz`;
  return Math.abs(hz) < 0.005 ? text : `${text} ${hz > 0 ? "↻" : "↺"}`;
}

/** What the grid and, where they are shown, the arrows of the forces mean. */
export function legend(forces) {
  return forces ? `grid 10 mm · force <i>↑</i> ${forces.length} mm = ${forces.force}, at most ${forces.longest} mm` : "grid 10 mm";
}
