// Draws once per frame of the browser while visible.

/// Returns a function that starts (true) and stops (false) calling `draw` once a frame; repeated calls do no harm.
export function drawing(draw) {
  let next = 0;
  const frame = (at) => {
    next = requestAnimationFrame(frame);
    draw(at);
  };
  return (yes) => {
    if (yes && next === 0) next = requestAnimationFrame(frame);
    if (!yes) {
      cancelAnimationFrame(next);
      next = 0;
    }
  };
}
