// Draws in frames of the browser while visible.

const kEarly_ms = 4;  // frames are not exactly periodic

/// Returns a function that starts (true) and stops (false) calling `draw`, at most every `period_ms()`; repeated calls do
/// no harm.
export function drawing(draw, period_ms = () => 0) {
  let next = 0;
  let drawnAt = -Infinity;
  const frame = (at) => {
    next = requestAnimationFrame(frame);
    if (at - drawnAt < period_ms() - kEarly_ms) return;
    drawnAt = at;
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
