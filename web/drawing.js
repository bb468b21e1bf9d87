// Pictures: one for each frame of the browser, and for as long as somebody looks.

/// Returns what begins (true) and ends (false) calling `draw` once a frame, however often it is said.
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
