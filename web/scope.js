// The scope: plots of chosen signals of drives over simulated time.

import {pace} from './capture.js';
import {byId, el, note} from './dom.js';
import {drawing} from './drawing.js';
import {figures} from './format.js';
import {Panels} from './panels.js';
import {saveCsv} from './csv.js';
import {fromAddress, toAddress} from './scope_address.js';
import {ScopeControls} from './scope_controls.js';
import {Layouts} from './scope_layouts.js';
import {Spectra} from './scope_spectra.js';
import {ScopeTable} from './scope_table.js';
import {dataOf, recolour, traceKey, tracesOf, watch} from './scope_traces.js';
import {ScopeWindow} from './scope_window.js';
import {Trigger} from './trigger.js';
import {TriggerControls} from './trigger_controls.js';
import {buses, busTime, driveKey, driveOf, on, store} from './store.js';
import {t} from './words.js';

const kTable_ms = 150;
const kDraw_ms = 33;
const kManyTraces = 16;    // assumed: more than this take most of a frame to draw
const kManyTraces_ms = 60;
const kLegend_ms = 50;
const kLatest_s = 1e9;     // assumed: no simulation lasts thirty years

const chosen = {drives: [], signals: ['angle_ref_deg', 'angle_deg', 'speed_dps', 'iq_A'], rate_Hz: 1000, hidden: new Set()};
let captures = [];
let recording = false;
let traces = [];
let visible = false;
let panels = null;
let spectra = null;
let controls = null;
let triggerControls = null;
let initial = null;   // layout of a new page
let table = null;
let frames = [];   // times of the last frames, for the display of the frame rate

// --- display

const newest_s = () => Math.max(0, ...captures.map((capture) => capture.samples.last_s || 0));
const trigger = new Trigger();
const shown = new ScopeWindow({newest: newest_s, trigger,
  onHold: () => {
    keep();
    controls.showHeld(true);
  },
  onRelease: () => {
    keep();
    trigger.arm(newest_s());
    controls.showHeld(false);
  },
  onWidth: (width_s) => controls.showWidth(width_s)});
let cursorsBefore = shown.cursors;  // before the first click of a possible double click

function view() {
  const {from_s, to_s} = shown.span;
  const marks = Object.entries(shown.cursors).filter(([, at]) => at !== null)
    .map(([name, time_s]) => ({time_s, name, colour: name === 'A' ? '--accent' : '--target'}));
  if (shown.mark_s !== null) marks.push({time_s: shown.mark_s, name: t('mark_frame'), colour: '--zero'});
  if (trigger.on && trigger.shot_s !== null) marks.push({time_s: trigger.shot_s, name: 'T', colour: '--good'});
  return {from_s, to_s, marks};
}

/// Keeps the samples in view while paused.
function keep() {
  for (const capture of captures) capture.samples.keepFrom = shown.held?.from_s ?? Infinity;
}

// --- recording

function restart() {
  traces = [];
  if (!store.status) return;
  captures = watch(captures, chosen, trigger.needs);
  captures.forEach((capture) => capture.record(recording));
  keep();
  traces = tracesOf(captures, chosen);
  repaint();
  if (shown.held && !captures.some((one) => one.samples.length)) shown.release();
  controls.showChosen(chosen);
}

function repaint() {
  recolour(traces);
  panels.set(traces);
  spectra.set();
  panels.fit();
  table.set(traces);
}

function toggle(trace) {
  trace.shown = !trace.shown;
  if (trace.shown) chosen.hidden.delete(traceKey(trace));
  else chosen.hidden.add(traceKey(trace));
  panels.showTrace(trace);
  spectra.refresh();
  table.showHidden();
}

function showSpectra(yes) {
  panels.withSides = yes;
  controls.showSpectra(yes);
  repaint();
}

// --- trigger

function retrigger() {
  trigger.listen(driveOf(trigger.settings.drive)?.bus);
  if (shown.held) shown.release();
  else trigger.arm(newest_s());
  restart();
}

/// Pauses at the plot of a single trigger.
function lookForTrigger() {
  if (!trigger.on || shown.held) return;
  const drive = driveOf(trigger.settings.drive);
  const capture = captures.find((one) => one.bus === drive?.bus);
  if (!trigger.look(capture, drive?.id, newest_s(), shown.width_s) || !trigger.done) return;
  const {from_s, to_s} = shown.span;
  shown.hold(from_s, to_s);
}

// --- plots

/// Returns a value that changes when a stationary plot must be redrawn; null: always redraw.
function pictureState() {
  if (!shown.stands) return null;
  const {from_s, to_s, marks} = view();
  return JSON.stringify([from_s, to_s, marks, panels.bins, panels.generation, captures.map(({samples}) => Math.min(samples.last_s, to_s))]);
}

let tableAt = 0;
let legendAt = 0;
let drawn = null;
const run = drawing((at) => {
  lookForTrigger();
  const now = pictureState();
  const {from_s, to_s} = shown.span;
  if (now === null || now !== drawn) panels.draw((some, bins) => dataOf(some, {from_s, to_s}, bins));
  drawn = now;
  spectra.update(at, {from_s, to_s}, now !== null);
  frames.push(at);
  while (frames[0] < at - 1000) frames.shift();
  if (at - legendAt > kLegend_ms) {
    legendAt = at;
    panels.showLegends();
  }
  if (at - tableAt > kTable_ms) {
    tableAt = at;
    table.show({from_s, to_s}, shown.cursors, shown.held !== null);
    controls.showFrames(frames.length, captures);
    triggerControls.showState();
  }
}, () => (traces.length > kManyTraces ? kManyTraces_ms : kDraw_ms));

// --- layouts

const layout = () => ({drives: chosen.drives.map(({bus, id}) => driveKey(bus, id)), signals: chosen.signals, hidden: [...chosen.hidden], rate_Hz: chosen.rate_Hz,
  width_s: shown.width_s, ranges: panels.ranges.toObject(), spectra: spectra.on, trigger: {...trigger.settings}});

/// Omits drives and signals that this program lacks; if no drive remains, keeps the previous choice.
function applyLayout({drives, signals, hidden, rate_Hz, width_s, ranges, spectra: withSpectra, trigger: settings}) {
  const there = drives.map(driveOf).filter(Boolean).map(({bus, id}) => ({bus, id}));
  if (there.length) chosen.drives = there;
  Object.assign(chosen, {signals: signals.filter((name) => store.signals.some((one) => one.name === name)), rate_Hz, hidden: new Set(hidden)});
  if (there.length < drives.length || chosen.signals.length < signals.length) note(t('layout_not_all'));
  Object.assign(trigger.settings, settings);
  triggerControls.show();
  panels.ranges.fromObject(ranges);
  panels.withSides = withSpectra;
  controls.showSpectra(withSpectra);
  controls.showRate(rate_Hz);
  if (shown.held) shown.release();
  shown.setWidth(width_s);
  controls.showWidth(width_s);
  retrigger();
}

// --- view

function exportCsv() {
  const {from_s, to_s} = shown.span;
  const rows = saveCsv(traces, from_s, to_s);
  note(rows ? t('csv_saved', {rows, from: figures(from_s), to: figures(to_s)}) : t('csv_nothing'), !rows);
}

function onKey(event) {
  if (!visible || event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey ||
    event.target.closest('input:not([type=checkbox]), select, textarea')) return;
  if (event.key === ' ' && event.target.closest('input, button, summary, a')) return;
  const does = {
    ' ': () => shown.pause(), '+': () => shown.zoom(0.5), '=': () => shown.zoom(0.5), '-': () => shown.zoom(2),
    ArrowLeft: () => shown.pan(-0.2), ArrowRight: () => shown.pan(0.2), f: () => showSpectra(!spectra.on),
    a: () => shown.putCursorAt('A', 1 / 3), b: () => shown.putCursorAt('B', 2 / 3), Escape: () => shown.clearCursors(),
  }[event.key];
  if (!does) return;
  event.preventDefault();
  does();
}

function onPoint(time_s, event) {
  const {A, B} = shown.cursors;
  if (shown.held) shown.putCursor(event.shiftKey ? 'B' : A === null ? 'A' : B === null ? 'B' : 'A', time_s);
}

function onWheel(event, plots) {
  event.preventDefault();
  if (event.ctrlKey) return panels.zoomAt(event, event.deltaY > 0 ? 1.25 : 0.8);
  const box = plots.querySelector('.u-over')?.getBoundingClientRect();
  const {from_s, to_s} = shown.span;
  const around = shown.held && box ? from_s + (to_s - from_s) * (event.clientX - box.left) / box.width : null;
  if (event.shiftKey) shown.pan(Math.sign(event.deltaY || event.deltaX) * 0.1);
  else shown.zoom(event.deltaY > 0 ? 1.25 : 0.8, around);
}

function build() {
  const plots = el('div', {class: 'plots', role: 'group', tabindex: 0, 'aria-label': t('plots_label')});
  controls = new ScopeControls(chosen, {restart, exportCsv, pause: () => shown.pause(), zoom: (factor) => shown.zoom(factor),
    pan: (share) => shown.pan(share), setWidth: (s) => shown.setWidth(s), clearCursors: () => shown.clearCursors(),
    putCursor: (name) => shown.putCursorAt(name, name === 'A' ? 1 / 3 : 2 / 3), spectra: () => showSpectra(!spectra.on)});
  triggerControls = new TriggerControls(trigger, retrigger);
  const layouts = new Layouts({current: layout, apply: applyLayout});
  table = new ScopeTable(toggle);
  controls.add({trigger: triggerControls.root, layouts: layouts.root, table: table.root});
  panels = new Panels(plots, {view, onPoint, onToggle: toggle, onSelect: (from_s, to_s) => shown.hold(from_s, to_s)});
  spectra = new Spectra(panels);
  panels.onFit = (heights, width) => spectra.fit(heights, width);
  plots.addEventListener('wheel', (event) => !event.target.closest('.panel-side') && onWheel(event, plots), {passive: false});
  // A double click sets no cursors: it restores those from before its first click.
  const ofPicture = (event) => !event.target.closest('button, .panel-side');
  plots.addEventListener('click', (event) => { if (event.detail === 1 && ofPicture(event)) cursorsBefore = {...shown.cursors}; }, true);
  plots.addEventListener('dblclick', (event) => {
    if (!ofPicture(event)) return;
    shown.cursors = cursorsBefore;
    shown.pause();
  });
  byId('view-scope').replaceChildren(controls.root, plots);
  document.addEventListener('keydown', onKey);
  document.addEventListener('theme', repaint);
}

export function show(yes) {
  visible = yes;
  if (!panels) return;
  if (yes) panels.fit();
  run(yes);
}

/// Starts or stops to receive samples. What is kept stays.
export function listen(yes) {
  recording = yes;
  captures.forEach((capture) => capture.record(yes));
}

/// Opens the view from a link; what it does not contain stays. At an instant, drives already shown stay.
export function visit(query) {
  const keys = (query.get('drive') ?? '').split(',').filter(Boolean);
  for (const key of keys) if (!driveOf(key)) note(t('no_such_drive', {name: key}), true);
  const present = layout();
  const stays = !keys.some(driveOf) || (query.has('time_s') && keys.every((key) => present.drives.includes(key)));
  query.set('drive', stays ? present.drives : keys.filter(driveOf));
  try {
    const {layout: wanted, times} = fromAddress(query, present);
    if (JSON.stringify(wanted) !== JSON.stringify(present)) applyLayout(wanted);
    if (times.from_s !== null) reopen(times);
  } catch (problem) {
    note(problem.message, true);
  }
  const time_s = Number(query.get('time_s') || NaN);
  if (!(time_s >= 0 && time_s < kLatest_s)) return;
  shown.hold(time_s - shown.width_s / 2, time_s + shown.width_s / 2);
  shown.mark_s = time_s;
  if (!traces.some(({capture, column}) => Number.isFinite(capture.samples.at(column, time_s) ?? NaN))) note(t('not_watched'), true);
}

/// Pauses again at a window, if its samples are still kept; otherwise only its width is used.
function reopen({from_s, to_s, A, B}) {
  if (!(from_s >= 0 && to_s > from_s && to_s < kLatest_s)) return;
  if (captures.some(({samples}) => samples.length && samples.first_s < to_s && samples.last_s > from_s)) {
    shown.hold(from_s, to_s);
    shown.cursors = {A, B};
  } else {
    shown.setWidth(to_s - from_s);
    controls.showWidth(shown.width_s);
  }
}

export const state = () => (panels ? toAddress(layout(), initial, shown.held, shown.cursors) : {});

/// State of the traces for tests and scripts.
export const inspect = () => ({traces, captures, view: view(), held: shown.held !== null, cursors: shown.cursors, frames: frames.length,
  time_s: busTime(buses()[0]?.bus), triggered_s: trigger.shot_s, ...(panels && {peaks: spectra.peaks, layout: layout(),
    values: panels.plots.map(({plot, unit}) => ({unit, min: plot.scales.y.min, max: plot.scales.y.max})),
    axes: panels.plots.map(({plot: {axes: [x, y]}, unit}, n) => ({unit, values: y._values, times: x._splits, time_name: x.label,
      frequency: spectra.on ? [spectra.plots[n].plot.axes[0].label, spectra.plots[n].plot.axes[0]._values] : null}))})});

on('program', () => {
  if (!panels) build();
  chosen.drives = chosen.drives.filter(({bus, id}) => store.drives.some((drive) => drive.bus === bus && drive.id === id));
  if (!chosen.drives.length && store.drives.length) chosen.drives = [{bus: store.drives[0].bus, id: store.drives[0].id}];
  controls.build();
  triggerControls.build();
  captures.forEach((capture) => capture.close());
  captures = [];
  initial ??= {...layout(), drives: store.drives.slice(0, 1).map(({bus, id}) => driveKey(bus, id))};
  retrigger();
  if (visible) show(true);
});
// A faster clock may exceed the rate limit; a slow or stopped one changes nothing.
on('change', () => {
  if (traces.length && captures.some((one) => one.pace !== pace())) restart();
});
