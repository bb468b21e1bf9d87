// The scope: chosen signals of chosen drives over simulated time.

import {Capture, pace, possibleRate_Hz} from './capture.js';
import {byId, el, note, setText} from './dom.js';
import {drawing} from './drawing.js';
import {figures, unitOf} from './format.js';
import {Panels} from './panels.js';
import {saveCsv} from './csv.js';
import {ScopeControls} from './scope_controls.js';
import {ScopeTable} from './scope_table.js';
import {buses, busTime, driveName, driveOf, on, store} from './store.js';
import {t} from './words.js';

const kShortest_s = 0.001;
const kLongest_s = 600;
const kTable_ms = 150;
const kLatest_s = 1e9;     // assumed: nobody simulates thirty years
const kWatchAll = 50_000;  // values a second: up to as many, all drives are watched, so that each has a past

const chosen = {drives: [], signals: ['angle_ref_deg', 'angle_deg', 'speed_dps', 'iq_A'], rate_Hz: 1000};
let captures = [];
let traces = [];
let width_s = 5;
let held = null;   // {from_s, to_s}: paused there
let cursors = {A: null, B: null};
let cursorsBefore = cursors;  // the first click of what may become two
let mark = null;   // an instant that somebody came for
let visible = false;
let panels = null;
let controls = null;
let table = null;
let frames = [];   // when the last pictures were drawn, for the display of their rate

// --- what is shown

const newest_s = () => Math.max(0, ...captures.map((capture) => capture.samples.last_s || 0));

function view() {
  const to_s = newest_s();
  const {from_s, to_s: end_s} = held ?? {from_s: to_s - width_s, to_s};
  const marks = Object.entries(cursors).filter(([, at]) => at !== null)
    .map(([name, time_s]) => ({time_s, name, colour: name === 'A' ? '--accent' : '--target'}));
  if (mark !== null) marks.push({time_s: mark, name: t('mark_frame'), colour: '--zero'});
  return {from_s, to_s: end_s, marks};
}

/// While paused, what is in view stays.
function keep() {
  for (const capture of captures) capture.samples.keepFrom = held?.from_s ?? Infinity;
}

function hold(from_s, to_s) {
  held = {from_s, to_s};
  keep();
  controls.showHeld(true);
  controls.showWidth(to_s - from_s);
}

function release() {
  if (held) width_s = Math.min(kLongest_s, Math.max(kShortest_s, held.to_s - held.from_s));
  held = null;
  mark = null;
  keep();
  controls.showHeld(false);
  controls.showWidth(width_s);
}

const pause = () => (held ? release() : hold(newest_s() - width_s, newest_s()));

function zoom(factor, around_s = null) {
  if (!held) {
    width_s = Math.min(kLongest_s, Math.max(kShortest_s, width_s * factor));
    controls.showWidth(width_s);
    return;
  }
  const span = held.to_s - held.from_s;
  const next = Math.min(kLongest_s, Math.max(kShortest_s, span * factor));
  const middle = around_s ?? (held.from_s + held.to_s) / 2;
  const share = (middle - held.from_s) / span;
  hold(middle - next * share, middle + next * (1 - share));
}

function setWidth(s) {
  if (held) zoom(s / (held.to_s - held.from_s));
  else width_s = s;
}

function pan(share) {
  const {from_s, to_s} = view();
  const by = (to_s - from_s) * share;
  hold(from_s + by, to_s + by);
}

function putCursor(name, time_s) {
  if (!held) pause();
  cursors[name] = time_s;
}

// --- what is kept

function colourOf(index, count) {
  const hue = count <= 8 ? [176, 38, 215, 340, 95, 275, 8, 60][index % 8] : (index * 137.5) % 360;
  const light = document.documentElement.dataset.theme === 'light';
  return `hsl(${hue} ${light ? 75 : 70}% ${light ? 36 : 64}%)`;
}

/// References are dashed, true values dotted, so that they can lie on what was measured.
function dashOf(signal) {
  if (signal.includes('_ref_')) return [9, 5];
  return signal.startsWith('true_') ? [2, 3] : undefined;
}

/// What is watched goes on as long as it serves. What is watched anew begins with what there is of the same signals.
function watch() {
  const {signals} = chosen;
  const all = store.drives.length * signals.length * chosen.rate_Hz <= kWatchAll;
  const drives = all ? store.drives : chosen.drives;
  const wanted = signals.length ? buses().map(({bus}) => ({bus, ids: drives.filter((one) => one.bus === bus).map((one) => one.id)}))
    .filter(({ids}) => ids.length) : [];
  const rate_Hz = possibleRate_Hz(chosen.rate_Hz, drives.length * signals.length);
  const before = new Map(captures.map((capture) => [capture.bus, capture]));
  if (wanted.every(({bus, ids}) => before.get(bus)?.serves(ids, signals, rate_Hz))) return;
  captures.forEach((capture) => capture.close());
  captures = wanted.map(({bus, ids}) => new Capture(bus, ids, signals, rate_Hz, before.get(bus)));
  keep();
}

function restart() {
  traces = [];
  if (!store.status) return;
  const signals = chosen.signals;
  watch();
  const many = chosen.drives.length > 1;
  const total = chosen.drives.length * signals.length;
  chosen.drives.forEach(({bus, id}, drive) => signals.forEach((signal, n) => {
    const capture = captures.find((one) => one.bus === bus);
    const index = many && signals.length > 1 && total > 8 ? drive : drive * signals.length + n;
    traces.push({bus, id, signal, capture, column: capture.column(id, signal), unit: unitOf(signal),
      label: `${driveName(bus, id)} ${signal}`, index, of: many && total > 8 ? chosen.drives.length : total, dash: dashOf(signal)});
  }));
  recolour();
  if (held && !captures.some((one) => one.samples.length)) release();
  controls.showChosen(chosen);
}

function recolour() {
  for (const trace of traces) trace.colour = colourOf(trace.index, trace.of);
  panels.set(traces);
  table.set(traces);
}

/// The times of one panel are those of its first capture; another bus is brought to them.
function dataOf(some, bins) {
  const {from_s, to_s} = view();
  const byCapture = new Map();
  for (const trace of some) {
    if (!byCapture.has(trace.capture)) byCapture.set(trace.capture, []);
    byCapture.get(trace.capture).push(trace);
  }
  const tables = [...byCapture].map(([capture, list]) =>
    capture.samples.view(from_s, to_s, bins, list.map((trace) => trace.column)));
  const joined = tables.length === 1 ? tables[0] : uPlot.join(tables.map((one) => one.map((column) => Array.from(column))));
  const order = [...byCapture.values()].flat();
  return [joined[0], ...some.map((trace) => joined[1 + order.indexOf(trace)])];
}

/// While paused the picture stays what it is, until something of this changes.
function state() {
  const {from_s, to_s, marks} = view();
  return held === null ? null : JSON.stringify([from_s, to_s, marks, panels.bins, panels.generation,
    captures.map(({samples}) => Math.min(samples.last_s, to_s))]);
}

let tableAt = 0;
let drawn = null;
const run = drawing((at) => {
  const now = state();
  if (now === null || now !== drawn) panels.draw(dataOf);
  drawn = now;
  frames.push(at);
  while (frames[0] < at - 1000) frames.shift();
  if (at - tableAt > kTable_ms) {
    tableAt = at;
    table.show(view(), cursors, held !== null);
    controls.showFrames(frames.length, captures);
  }
});

// --- the view

function exportCsv() {
  const {from_s, to_s} = view();
  const rows = saveCsv(traces, from_s, to_s);
  note(rows ? t('csv_saved', {rows, from: figures(from_s), to: figures(to_s)}) : t('csv_nothing'), !rows);
}

function onKey(event) {
  if (!visible || event.ctrlKey || event.metaKey || event.altKey || event.target.closest('input:not([type=checkbox]), select, textarea')) return;
  if (event.key === ' ' && event.target.closest('input, button, summary, a')) return;
  const does = {
    ' ': pause, '+': () => zoom(0.5), '=': () => zoom(0.5), '-': () => zoom(2), ArrowLeft: () => pan(-0.2), ArrowRight: () => pan(0.2),
    a: () => putCursor('A', (view().from_s * 2 + view().to_s) / 3), b: () => putCursor('B', (view().from_s + view().to_s * 2) / 3),
    Escape: () => { cursors = {A: null, B: null}; },
  }[event.key];
  if (!does) return;
  event.preventDefault();
  does();
}

function onPoint(time_s, event) {
  if (!held) return;
  putCursor(event.shiftKey ? 'B' : cursors.A === null ? 'A' : cursors.B === null ? 'B' : 'A', time_s);
}

function build() {
  const root = byId('view-scope');
  const plots = el('div', {class: 'plots', role: 'group', tabindex: 0, 'aria-label': t('plots_label')});
  controls = new ScopeControls(chosen, {restart, pause, zoom, pan, exportCsv, setWidth,
    clearCursors: () => { cursors = {A: null, B: null}; },
    putCursor: (name) => putCursor(name, view().from_s + (view().to_s - view().from_s) * (name === 'A' ? 1 / 3 : 2 / 3))});
  table = new ScopeTable();
  panels = new Panels(plots, {view, onPoint, onSelect: (from_s, to_s) => hold(from_s, to_s)});
  plots.addEventListener('wheel', (event) => {
    event.preventDefault();
    const box = plots.querySelector('.u-over')?.getBoundingClientRect();
    const {from_s, to_s} = view();
    const around = held && box ? from_s + (to_s - from_s) * (event.clientX - box.left) / box.width : null;
    if (event.shiftKey) pan(Math.sign(event.deltaY || event.deltaX) * 0.1);
    else zoom(event.deltaY > 0 ? 1.25 : 0.8, around);
  }, {passive: false});
  // Two clicks put no cursors: those that they did put go again.
  plots.addEventListener('click', (event) => { if (event.detail === 1) cursorsBefore = {...cursors}; }, true);
  plots.addEventListener('dblclick', () => {
    cursors = cursorsBefore;
    pause();
  });
  root.replaceChildren(controls.root, plots, table.root);
  document.addEventListener('keydown', onKey);
  document.addEventListener('theme', recolour);
}

export function show(yes) {
  visible = yes;
  if (!panels) return;
  if (yes) panels.fit();
  run(yes);
}

/// From elsewhere: a drive, that one alone; or an instant of it, among whatever drives are shown.
export function visit(query) {
  const key = query.get('drive');
  const drive = driveOf(key);
  if (key && !drive) note(t('no_such_drive', {name: key}), true);
  const isShown = drive && chosen.drives.some(({bus, id}) => bus === drive.bus && id === drive.id);
  if (drive && !(isShown && query.has('time_s'))) controls.pick([{bus: drive.bus, id: drive.id}]);
  const time_s = Number(query.get('time_s') || NaN);
  if (!(time_s >= 0 && time_s < kLatest_s)) return;
  hold(time_s - width_s / 2, time_s + width_s / 2);
  mark = time_s;
  if (!traces.some(({capture, column}) => Number.isFinite(capture.samples.at(column, time_s) ?? NaN))) note(t('not_watched'), true);
}

/// For tests and scripts: what is drawn of a trace.
export const inspect = () => ({traces, captures, view: view(), held: held !== null, cursors, frames: frames.length, time_s: busTime(buses()[0]?.bus)});

on('program', () => {
  if (!panels) build();
  chosen.drives = chosen.drives.filter(({bus, id}) => store.drives.some((drive) => drive.bus === bus && drive.id === id));
  if (!chosen.drives.length && store.drives.length) chosen.drives = [{bus: store.drives[0].bus, id: store.drives[0].id}];
  controls.build();
  captures.forEach((capture) => capture.close());
  captures = [];
  if (held) release();
  restart();
  if (visible) show(true);
});
// A faster clock may be too much; one that is slow or stands changes nothing.
on('change', () => {
  if (traces.length && captures.some((one) => one.pace !== pace())) restart();
});
