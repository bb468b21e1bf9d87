// A spectrum next to each plot of the scope: amplitudes of the samples in view, in their unit, against frequency.

import {columnsOf, peakOf, spectrum} from './fft.js';
import {el} from './dom.js';
import {axisName, figures} from './format.js';
import {axisStyle, kAxis_px, kPadding} from './panels.js';
import {t} from './words.js';

const kMaxRunning = 1 << 13;   // samples of a moving plot, to finish within a frame
const kMaxHeld = 1 << 17;
const kEach_ms = 50;           // between two transforms of a moving plot
const kColumns = 500;
const kMaxLabels = 4;          // in one plot

/// Returns the newest samples of a trace in view without a gap: {values, rate_Hz, from_s, to_s}; null: too few.
export function piece({capture, column}, {from_s, to_s}, most) {
  const {samples} = capture;
  const values = samples.values[column];
  const end = samples.find(to_s + 1e-9);
  const least = Math.max(samples.find(from_s), end - most);
  if (end - least < 8) return null;
  const step_s = samples.times[end - 1] - samples.times[end - 2];
  let begin = end - 1;
  while (begin > least && samples.times[begin] - samples.times[begin - 1] < 1.5 * step_s && Number.isFinite(values[begin - 1])) --begin;
  if (end - begin < 8 || !Number.isFinite(values[end - 1])) return null;
  const span_s = samples.times[end - 1] - samples.times[begin];
  return {values: values.subarray(begin, end), rate_Hz: (end - begin - 1) / span_s, from_s: samples.times[begin], to_s: samples.times[end - 1]};
}

export class Spectra {
  constructor(panels) {
    this.panels = panels;
    this.plots = [];
    this.of = new Map();  // by trace: {step_Hz, lines, peak, key}
    this.at = 0;
    this.next = 0;        // index of the next trace
  }

  get on() {
    return this.panels.withSides;
  }

  /// Builds the spectra for the present plots.
  set() {
    this.plots.forEach(({plot}) => plot.destroy());
    this.of.clear();
    this.plots = this.on ? this.panels.plots.map((panel, n) => this.make(panel, n === this.panels.plots.length - 1)) : [];
  }

  make({unit, traces, side}, lowest) {
    const axis = axisStyle();
    const zoom = {range_Hz: null};
    side.setAttribute('role', 'img');
    side.setAttribute('aria-label', t('spectrum_of', {name: axisName(unit)}));
    const span = el('span', {class: 'spectrum-span dim'});
    const plot = new uPlot({
      width: 200, height: 120, legend: {show: false}, pxAlign: 0, padding: kPadding,
      cursor: {drag: {x: true, y: false, setScale: false}, points: {show: false}, y: false},
      scales: {x: {time: false, range: () => zoom.range_Hz ?? [0, this.most_Hz(traces)]}, y: {range: (u, min, max) => [0, max > 0 ? max * 1.15 : 1]}},
      axes: [{...axis, size: 20, label: t('axis_frequency'), values: (u, ticks) => ticks.map((tick) => figures(tick, 6))},
        {...axis, size: kAxis_px, space: 24, values: (u, ticks) => ticks.map((tick) => figures(tick, 4))}],
      series: [{}, ...traces.map((trace) => ({stroke: trace.colour, width: 1, points: {show: false}}))],
      hooks: {draw: [(u) => this.label(u, traces)], setSelect: [(u) => {
        zoom.range_Hz = [u.posToVal(u.select.left, 'x'), u.posToVal(u.select.left + u.select.width, 'x')];
        u.setSelect({left: 0, width: 0, top: 0, height: 0}, false);
        this.show({plot: u, traces, zoom, span});
      }]},
    }, [[], ...traces.map(() => [])], side);
    plot.over.addEventListener('dblclick', () => {
      zoom.range_Hz = null;
      this.show({plot, traces, zoom, span});
    });
    side.append(el('span', {class: 'axis-name', text: axisName(unit)}), span);
    return {plot, traces, zoom, span, lowest};
  }

  most_Hz(traces) {
    return Math.max(1, ...traces.map((trace) => trace.capture.rate_Hz / 2));
  }

  fit(heights, width) {
    if (width > 100) this.plots.forEach(({plot}, n) => plot.setSize({width, height: heights[n]}));
  }

  /// Computes one transform: every kEach_ms for a moving plot, every frame for a standing one until all are done.
  update(at, {from_s, to_s}, stands) {
    if (!this.on || (!stands && at - this.at < kEach_ms)) return;
    const all = this.plots.flatMap((one) => one.traces.filter((trace) => trace.shown).map((trace) => ({trace, plot: one})));
    for (let n = 0; n < all.length; ++n) {
      const {trace, plot} = all[this.next++ % all.length];
      const key = `${stands} ${from_s} ${to_s} ${Math.min(trace.capture.samples.last_s, to_s)}`;
      if (this.of.get(trace)?.key === key) continue;
      this.at = at;
      const found = piece(trace, {from_s, to_s}, stands ? kMaxHeld : kMaxRunning);
      const lines = found && spectrum(found.values, found.rate_Hz);
      this.of.set(trace, {...lines, key, found, peak: lines ? peakOf(lines) : null});
      this.show(plot);
      return;
    }
  }

  /// Call after traces were hidden or shown.
  refresh() {
    this.plots.forEach((one) => this.show(one));
  }

  show({plot, traces, zoom, span}) {
    const [from_Hz, to_Hz] = zoom.range_Hz ?? [0, this.most_Hz(traces)];
    const axis = Float64Array.from({length: kColumns}, (_, n) => from_Hz + (to_Hz - from_Hz) * (n + 0.5) / kColumns);
    plot.setData([axis, ...traces.map((trace) => {
      const one = this.of.get(trace);
      return trace.shown && one?.lines ? columnsOf(one, from_Hz, to_Hz, kColumns) : new Array(kColumns).fill(null);
    })]);
    const found = traces.map((trace) => this.of.get(trace)?.found).find(Boolean);
    span.textContent = found ? t('spectrum_span', {s: figures(found.to_s - found.from_s, 3)}) : t('spectrum_none');
  }

  /// Labels the peaks of the strongest traces.
  label(u, traces) {
    const {ctx} = u;
    const ratio = devicePixelRatio;
    const peaks = traces.map((trace) => ({trace, peak: trace.shown ? this.of.get(trace)?.peak : null})).filter(({peak}) => peak)
      .sort((a, b) => b.peak.amplitude - a.peak.amplitude).slice(0, kMaxLabels);
    ctx.save();
    ctx.font = `${12 * ratio}px system-ui, sans-serif`;
    peaks.forEach(({trace, peak}, n) => {
      const x = u.valToPos(peak.frequency_Hz, 'x', true);
      const y = u.valToPos(peak.amplitude, 'y', true);
      if (x < u.bbox.left || x > u.bbox.left + u.bbox.width) return;
      ctx.fillStyle = trace.colour;
      ctx.beginPath();
      ctx.arc(x, y, 3 * ratio, 0, 2 * Math.PI);
      ctx.fill();
      const text = `${figures(peak.frequency_Hz, 4)} Hz  ${figures(peak.amplitude, 3)}`;
      const right = x + (8 * ratio) + ctx.measureText(text).width < u.bbox.left + u.bbox.width;
      ctx.textAlign = right ? 'left' : 'right';
      ctx.fillText(text, x + (right ? 8 : -8) * ratio, u.bbox.top + (14 + 15 * n) * ratio);
    });
    ctx.restore();
  }

  /// The peaks by label, for tests and scripts.
  get peaks() {
    return Object.fromEntries([...this.of].map(([trace, {peak}]) => [trace.label, peak]));
  }
}
