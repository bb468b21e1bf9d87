// Value axes of the scope's plots: automatic, until the user changes them.

const kStep = 0.8;

/// Ranges by unit, so that a plot keeps its range when it is rebuilt.
export class ValueRanges {
  constructor(onChange) {
    this.byUnit = new Map();
    this.onChange = onChange;
  }

  /// Returns [min, max]; undefined: automatic.
  get(unit) {
    return this.byUnit.get(unit);
  }

  set(unit, min, max) {
    const span = max - min;
    const size = Math.max(Math.abs(min), Math.abs(max), 1e-3);
    if (!(span > size * 1e-6 && size < 1e12)) return;  // otherwise uPlot fails to compute ticks
    this.byUnit.set(unit, [min, max]);
    this.onChange();
  }

  auto(unit) {
    this.byUnit.delete(unit);
    this.onChange();
  }

  zoom({plot, unit}, factor, around = null) {
    const {min, max} = plot.scales.y;
    if (min === null) return;
    const middle = around ?? (min + max) / 2;
    this.set(unit, middle - (middle - min) * factor, middle + (max - middle) * factor);
  }

  move({plot, unit}, share) {
    const {min, max} = plot.scales.y;
    if (min !== null) this.set(unit, min + (max - min) * share, max + (max - min) * share);
  }

  clear() {
    this.byUnit.clear();
    this.onChange();
  }

  /// Returns {unit: [min, max]} of the axes that are not automatic; the next method restores them.
  toObject() {
    return Object.fromEntries(this.byUnit);
  }
  fromObject(ranges) {
    this.byUnit = new Map(Object.entries(ranges));
    this.onChange();
  }
}

/// Controls of a plot's value axis: the wheel zooms, dragging moves, a double click makes it automatic again. Keys do
/// this while the plot has the focus.
export function byHand(ranges, panel) {
  const {plot, unit, holder} = panel;
  const axis = plot.root.querySelectorAll('.u-axis')[1];
  axis.classList.add('by-hand');
  let from = null;
  axis.addEventListener('wheel', (event) => {
    event.preventDefault();
    event.stopPropagation();
    ranges.zoom(panel, event.deltaY > 0 ? 1 / kStep : kStep, plot.posToVal(event.clientY - plot.over.getBoundingClientRect().top, 'y'));
  }, {passive: false});
  axis.addEventListener('pointerdown', (event) => {
    from = event.button === 0 ? event.clientY : null;
    if (from !== null) axis.setPointerCapture(event.pointerId);
  });
  axis.addEventListener('pointermove', (event) => {
    if (from === null) return;
    ranges.move(panel, (event.clientY - from) / plot.over.clientHeight);
    from = event.clientY;
  });
  for (const end of ['pointerup', 'pointercancel']) axis.addEventListener(end, () => { from = null; });
  axis.addEventListener('dblclick', (event) => {
    event.stopPropagation();  // a double click on the plot pauses
    ranges.auto(unit);
  });
  holder.addEventListener('keydown', (event) => {
    if (event.target !== holder || event.ctrlKey || event.metaKey || event.altKey) return;
    const does = {
      ArrowUp: () => (event.shiftKey ? ranges.zoom(panel, kStep) : ranges.move(panel, 0.1)),
      ArrowDown: () => (event.shiftKey ? ranges.zoom(panel, 1 / kStep) : ranges.move(panel, -0.1)),
      y: () => ranges.auto(unit),
    }[event.key];
    if (!does) return;
    event.preventDefault();
    does();
  });
}
