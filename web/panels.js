// The scope's plots: one for each unit, stacked, with a common time axis. uPlot draws them.

import {el} from './dom.js';
import {axisName, figures} from './format.js';
import {byHand, ValueRanges} from './panel_ranges.js';
import {PlotLegend} from './plot_legend.js';
import {t} from './words.js';

export const kAxis_px = 58;
const kSide = 0.4;     // share of the width for the spectra
export const kPadding = [28, null, null, null];  // space for the legend above a plot
const kLeast_px = 96;  // room for three numbers
const kMaxPoints = 30_000;  // in all plots: limit of a processor at 60 frames a second
const kLeastBins = 160;
const kFew = 12;             // with more traces, none has dashes
const kPadding_px = 10;
const kTimes_px = 28;  // extra height of the plot with the time axis
const kFont = '12px system-ui, sans-serif';
const kDrag_px = 4;    // shorter drags count as clicks, since hands tremble

export const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/// Keeps the range wide enough for distinct ticks; otherwise uPlot would compute ticks for ever.
export function range(self, min, max) {
  if (!Number.isFinite(min) || !Number.isFinite(max)) return [0, 1];
  const size = Math.max(Math.abs(min), Math.abs(max));
  const least = Math.max(size, 1) * 1e-9;
  const span = max - min >= least ? max - min : size > least ? size * 0.1 : 1;
  return [min - span * 0.06, max + span * 0.06];
}

const kLeastTicks = 3;
const kSteps = [7.5, 5, 4, 3, 2.5, 2, 1.5, 1];

/// Returns the multiples of `step`, or else of the largest round step of which three are in the range.
export function ticksOf(min, max, step) {
  const multiples = (by) => {
    const first = Math.ceil(min / by - 1e-9);
    return Array.from({length: Math.max(0, Math.floor(max / by + 1e-9) - first + 1)}, (_, n) => (first + n) * by);
  };
  let ticks = multiples(step);
  for (let power = Math.floor(Math.log10(step)); ticks.length < kLeastTicks && max > min; --power) {
    ticks = kSteps.map((digits) => multiples(digits * 10 ** power)).find((some) => some.length >= kLeastTicks) ?? [];
  }
  return ticks;
}

/// Common style of all axes: colours, fonts, ticks.
export const axisStyle = () => ({stroke: css('--dim'), grid: {stroke: css('--grid'), width: 1}, ticks: {show: false}, font: kFont,
  labelFont: kFont, labelSize: 16, labelGap: 0, splits: (u, axis, min, max, step) => ticksOf(min, max, step)});

/// `traces` are {label, colour, dash, unit, shown}; `view()` returns {from_s, to_s, cursors, marks}; `onToggle` is
/// called with a trace to hide or show.
export class Panels {
  constructor(root, {onSelect, onPoint, onToggle, view}) {
    this.root = root;
    this.onSelect = onSelect;
    this.onPoint = onPoint;
    this.onToggle = onToggle;
    this.view = view;
    this.ranges = new ValueRanges(() => ++this.generation);
    this.withSides = false;  // space next to each plot for its spectrum
    this.onFit = () => {};   // called with the height of each plot and the width next to it
    this.plots = [];
    this.width = 0;
    this.generation = 0;  // increases when plots must be redrawn
    this.traces = [];
    this.dragged = false;  // since the button was pressed
    new ResizeObserver(() => this.fit()).observe(root);
  }

  set(traces) {
    ++this.generation;
    this.traces = traces;
    this.plots.forEach(({plot}) => plot.destroy());
    const units = [...new Set(traces.map((trace) => trace.unit))];
    this.root.replaceChildren();
    this.plots = units.map((unit, n) => this.make(unit, traces.filter((trace) => trace.unit === unit), n === units.length - 1));
  }

  make(unit, traces, lowest) {
    const holder = el('div', {class: 'panel-plot', role: 'group', tabindex: 0,
      'aria-label': t('plot_of', {name: axisName(unit), traces: traces.map((trace) => trace.label).join(', ')})});
    const side = el('div', {class: 'panel-side'});
    this.root.append(el('div', {class: 'panel-row'}, holder, side));
    const axis = axisStyle();
    const few = this.traces.length <= kFew;
    const plot = new uPlot({
      width: 300, height: 120, legend: {show: false}, pxAlign: 0, padding: kPadding,
      cursor: {sync: {key: 'scope'}, drag: {x: false, y: false, setScale: false, click: () => {}}, bind: {mousedown: () => null}, points: {show: traces.length <= 8}, y: false},
      select: {show: true},
      scales: {x: {time: false, range: () => { const v = this.view(); return [v.from_s, v.to_s]; }},
        y: {range: (u, min, max) => this.ranges.get(unit) ?? range(u, min, max)}},
      axes: [
        lowest ? {...axis, size: 20, label: t('axis_time'), values: (u, ticks) => ticks.map((tick) => figures(tick, 9))} : {...axis, size: 8, values: () => []},
        {...axis, size: kAxis_px, space: 24, values: (u, ticks) => ticks.map((tick) => figures(tick, 6))},
      ],
      series: [{}, ...traces.map((trace) => ({label: trace.label, stroke: trace.colour, width: 1, dash: few ? trace.dash : undefined,
        show: trace.shown, points: {show: false}, spanGaps: true}))],
      hooks: {draw: [(u) => this.drawMarks(u)]},
    }, [[], ...traces.map(() => [])], holder);
    plot.over.addEventListener('click', (event) => {
      const left = event.clientX - plot.over.getBoundingClientRect().left;
      if (!this.dragged) this.onPoint(plot.posToVal(left, 'x'), event);
    });
    this.selectByDragging(plot);
    byHand(this.ranges, {plot, unit, holder});
    const legend = new PlotLegend(holder, axisName(unit), traces, {onToggle: this.onToggle, onAuto: () => this.ranges.auto(unit)});
    return {plot, unit, traces, holder, side, legend};
  }

  /// Applies `trace.shown`.
  showTrace(trace) {
    ++this.generation;
    for (const {plot, traces, legend} of this.plots) {
      const place = traces.indexOf(trace);
      if (place < 0) continue;
      plot.setSeries(place + 1, {show: trace.shown});
      legend.showHidden();
    }
  }

  /// Shows the values below the pointer in all plots.
  showLegends() {
    for (const {plot, unit, legend} of this.plots) {
      const {left} = plot.cursor;
      legend.show(left >= 0 ? plot.posToVal(left, 'x') : null, this.ranges.get(unit) !== undefined);
    }
  }

  /// Zooms the values of the plot below the pointer.
  zoomAt(event, factor) {
    const panel = this.plots.find(({holder}) => holder.contains(event.target));
    if (panel) this.ranges.zoom(panel, factor, panel.plot.posToVal(event.clientY - panel.plot.over.getBoundingClientRect().top, 'y'));
  }

  /// Selects a part of the screen in pixels, since the axis moves below the pointer while the scope runs.
  selectByDragging(u) {
    let from = null;
    const place = (event) => {
      const {left, width} = u.over.getBoundingClientRect();
      return Math.min(width, Math.max(0, event.clientX - left));
    };
    const show = (left, width) => this.plots.forEach(({plot}) =>
      plot.setSelect({left, width, top: 0, height: width && plot.over.clientHeight}, false));
    u.over.addEventListener('pointerdown', (event) => {
      if (event.button !== 0) return;
      from = place(event);
      this.dragged = false;
      u.over.setPointerCapture(event.pointerId);
    });
    u.over.addEventListener('pointermove', (event) => {
      if (from === null) return;
      const to = place(event);
      this.dragged ||= Math.abs(to - from) >= kDrag_px;
      if (this.dragged) show(Math.min(from, to), Math.abs(to - from));
    });
    const end = (event) => {
      if (from === null) return;
      const [left, right] = [from, place(event)].sort((a, b) => a - b);
      from = null;
      show(0, 0);
      if (event.type === 'pointerup' && this.dragged && right - left >= kDrag_px) this.onSelect(u.posToVal(left, 'x'), u.posToVal(right, 'x'));
    };
    u.over.addEventListener('pointerup', end);
    u.over.addEventListener('pointercancel', end);
  }

  drawMarks(u) {
    const {ctx, bbox} = u;
    ctx.save();
    ctx.lineWidth = devicePixelRatio;
    ctx.textAlign = 'left';
    ctx.font = `${12 * devicePixelRatio}px system-ui, sans-serif`;
    for (const {time_s, name, colour} of this.view().marks) {
      const x = u.valToPos(time_s, 'x', true);
      if (x < bbox.left || x > bbox.left + bbox.width) continue;
      ctx.strokeStyle = ctx.fillStyle = css(colour);
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
      ctx.fillText(name, x + 4 * devicePixelRatio, bbox.top + bbox.height - 5 * devicePixelRatio);  // the legend is at the top
    }
    ctx.restore();
  }

  /// Number of columns: the width in pixels, fewer with many traces.
  get bins() {
    const pixels = Math.max(200, Math.round(this.width - kAxis_px - 20));
    return Math.min(pixels, Math.max(kLeastBins, Math.round(kMaxPoints / 2 / (this.traces.length || 1))));
  }

  /// Pre: `dataOf(traces, bins)` returns [times, values…] for the traces of one panel.
  draw(dataOf) {
    for (const {plot, traces} of this.plots) {
      plot.setData(dataOf(traces, this.bins), true);
    }
  }

  fit() {
    const all = this.root.clientWidth;
    const beside = this.withSides ? Math.round(all * kSide) : 0;
    const width = all - beside - kPadding_px;
    const height = this.root.clientHeight;
    this.width = width;
    if (width < 50 || !this.plots.length) return;
    ++this.generation;
    const each = Math.max(kLeast_px, Math.floor((height - kPadding_px - kTimes_px) / this.plots.length));
    const heights = this.plots.map((_, n) => each + (n === this.plots.length - 1 ? kTimes_px : 0));
    this.plots.forEach(({plot}, n) => plot.setSize({width, height: heights[n]}));
    this.onFit(heights, beside);
  }
}
