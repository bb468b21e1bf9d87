// The traffic view: every frame, decoded by the program (GET /frames).

import {stream} from './api.js';
import {byId, el, labelled, note, setText} from './dom.js';
import {driveGroups, showPressed} from './drive_list.js';
import {drawing} from './drawing.js';
import {figures} from './format.js';
import {buses, driveKey, driveOf, on, store} from './store.js';
import {filter, forget, frameAt, frameBefore, keep, kept, lostFrames, refilter, tellLost} from './traffic_frames.js';
import {frameRow} from './traffic_row.js';
import {t} from './words.js';

const kRow_px = 24;     // height of a row of one line (views.css)
const kValues = 6;      // place of the column that takes the rest of the width
const kMargin = 12;     // rows drawn outside the visible part
const kDraw_ms = 80;    // faster updates are not readable

let streams = [];
let listening = false;
let paused = false;
let stale = true;       // the table must be redrawn
let visible = false;
let wanted = false;
let wasVisible = false;
let parts = null;
let drawnAt = 0;
let row_px = kRow_px;
let needed_px = 0;      // width of rows of one line, if it was more than there was
let rows = new Map();   // rows in the table, by frame
let dropped = 0;        // frames dropped so far, as far as the scroll position accounts for them

/// Parses "9C, a4 0xA2" as command bytes; null if empty.
function readCommands(text) {
  const list = text.toUpperCase().split(/[\s,]+/).map((one) => one.replace(/^0X/, '')).filter(Boolean);
  return list.length ? new Set(list) : null;
}

function refresh() {
  refilter();
  rows = new Map();  // the previous visible frame, and so the gap, has changed
  dropped = 0;
  stale = true;
}

// --- input

function take(bus, message) {
  if (!listening) stale = listening = true;
  if (message.lost) tellLost(bus, message.lost);
  if (paused || !message.frames) return;
  keep(bus, message.frames);
  stale = true;
}

/// Starts or stops to receive frames, once the view was visible. What is kept stays.
export function listen(yes) {
  if (yes === wanted) return;
  wanted = yes;
  open();
}

function open() {
  streams.forEach((one) => one.close());
  streams = [];
  if (!wanted || !wasVisible || !store.status) return;
  streams = buses().map(({bus}) => stream(`/frames?bus=${encodeURIComponent(bus)}`, {onMessage: (message) => take(bus, message)}));
}

// --- display

/// Rows that stay are not touched, so that a pending click still hits them.
function showRows(body, first, last) {
  const before = rows;
  rows = new Map();
  for (let n = first; n < last; ++n) {
    const frame = kept.shown[n];
    const row = before.get(frame) ?? frameRow(frame, frameBefore(n));
    if (row.ariaRowIndex !== String(n + 2)) row.ariaRowIndex = n + 2;  // the header is row 1
    rows.set(frame, row);
  }
  const wanted = [...rows.values()];
  const there = new Set(wanted);
  for (const old of [...body.children]) if (!there.has(old)) old.remove();
  wanted.forEach((one, n) => {
    if (body.children[n] !== one) body.insertBefore(one, body.children[n] ?? null);
  });
}

function setRowHeight(px) {
  const first = parts.scroller.scrollTop / row_px;
  row_px = px;
  parts.table.style.setProperty('--row', `${px}px`);
  parts.scroller.scrollTop = first * px;
  stale = parts.scrolled = true;
}

/// Gives rows several lines if one would be cut off; keeps the scroll position.
function fit() {
  const {scroller, table} = parts;
  if (!scroller.clientWidth) return;
  table.classList.toggle('narrow', scroller.clientWidth < needed_px);
  setRowHeight(kRow_px);
}

/// Adapts the table to its rows: columns never become narrower, and all rows are as high as the highest.
function adapt() {
  const {scroller, table, heads} = parts;
  if (table.classList.contains('narrow')) {
    const highest = Math.max(0, ...[...rows.values()].map((row) => row.offsetHeight));
    if (highest > row_px) setRowHeight(highest);
  } else if (table.offsetWidth > scroller.clientWidth) {
    needed_px = table.offsetWidth;
    fit();
  } else {
    const widths = heads.map((head) => head.offsetWidth);
    heads.forEach((head, n) => { if (n !== kValues) head.style.minWidth = `${widths[n]}px`; });
  }
}

/// The table contains only the visible rows.
const run = drawing((at) => {
  if (!stale || (!parts.scrolled && at - drawnAt < kDraw_ms)) return;
  stale = parts.scrolled = false;
  drawnAt = at;
  const {scroller, body, above, below, info} = parts;
  const {all, shown} = kept;
  if (kept.dropped !== dropped) scroller.scrollTop -= (kept.dropped - dropped) * row_px;  // keep the reader's position
  dropped = kept.dropped;
  const following = !paused && parts.follow;
  const fits = Math.ceil(scroller.clientHeight / row_px);
  const top = following ? Math.max(0, shown.length - fits + 1) : Math.floor(scroller.scrollTop / row_px);
  const first = Math.max(0, top - kMargin);
  const last = Math.min(shown.length, top + fits + kMargin);
  above.style.height = `${first * row_px}px`;
  below.style.height = `${(shown.length - last) * row_px}px`;
  showRows(body, first, last);
  adapt();
  parts.table.setAttribute('aria-rowcount', shown.length + 1);
  if (following) scroller.scrollTop = scroller.scrollHeight;
  if (listening) setText(info, t('frames_info', {shown: shown.length, all: all.length}) + (lostFrames() ? t('frames_lost', {n: lostFrames()}) : ''));
});

function setPaused(yes) {
  paused = yes;
  setText(parts.pause, yes ? t('resume') : t('pause'));
  parts.pause.setAttribute('aria-pressed', yes);
  if (!yes) parts.follow = true;
  stale = true;
}

function build() {
  const check = el('input', {type: 'checkbox', onchange: () => { filter.marked = check.checked; refresh(); }});
  const applyFields = () => {
    filter.commands = readCommands(commands.value);
    filter.text = text.value.toLowerCase();
    read = [commands.value, text.value].join('\n');
    refresh();
  };
  // Some browsers clear fields without an input event. Leaving a field keeps the rows, one of which may be clicked.
  let read = '\n';
  const readFields = () => {
    if ([commands.value, text.value].join('\n') !== read) applyFields();
  };
  const clearFields = () => {
    filter.from = from.value = commands.value = text.value = '';
    filter.marked = check.checked = false;
    applyFields();
  };
  const readAddress = (query) => {
    if (query.has('from')) filter.from = from.value = ['host', 'drive'].includes(query.get('from')) ? query.get('from') : '';
    commands.value = query.get('commands') ?? commands.value;
    text.value = query.get('text') ?? text.value;
    if (query.has('marked')) filter.marked = check.checked = query.get('marked') === '1';
    applyFields();
  };
  const commands = el('input', {type: 'text', size: 12, placeholder: '9C, A4', oninput: readFields, onchange: readFields});
  const text = el('input', {type: 'search', size: 16, placeholder: t('any_text'), oninput: readFields, onchange: readFields});
  const from = el('select', {onchange: () => { filter.from = from.value; refresh(); }},
    el('option', {value: '', text: t('both_ways')}), el('option', {value: 'host', text: t('queries')}), el('option', {value: 'drive', text: t('replies_only')}));
  const pause = el('button', {type: 'button', class: 'main', 'aria-pressed': 'false', onclick: () => setPaused(!paused)}, t('pause'));
  const info = el('span', {class: 'dim', id: 'traffic-info'});
  const drives = el('div', {class: 'row picks', role: 'group', 'aria-label': t('drives')});
  const body = el('tbody');
  const above = el('div');
  const below = el('div');
  const heads = [t('head_time'), t('head_gap'), t('bus'), t('head_way'), t('head_command'), t('head_name'), t('head_says'), t('head_frame'), t('scope')].map((head, n) =>
    el('th', {scope: 'col', class: n < 2 ? 'num' : ''}, el('span', {class: n === 2 || n === 8 ? 'sr' : '', text: head})));
  const table = el('table', {'aria-label': t('frames_label')}, el('thead', {}, el('tr', {'aria-rowindex': 1}, ...heads)), body);
  const scroller = el('div', {class: 'frames', tabindex: 0, role: 'region', 'aria-label': t('frames_scroller')}, above, table, below);
  scroller.addEventListener('scroll', () => {
    parts.follow = scroller.scrollTop + scroller.clientHeight > scroller.scrollHeight - 2 * row_px;
    stale = parts.scrolled = true;
  });
  new ResizeObserver(fit).observe(scroller);
  scroller.addEventListener('wheel', (event) => { if (event.deltaY < 0) parts.follow = false; }, {passive: true});
  parts = {pause, info, drives, body, above, below, table, heads, scroller, follow: true, scrolled: false, clearFields, readAddress,
    state: () => ({from: filter.from, commands: commands.value, text: text.value, marked: filter.marked ? 1 : ''})};
  byId('view-traffic').replaceChildren(
    el('div', {class: 'row'}, pause, labelled(t('show'), from), labelled(t('commands'), commands), labelled(t('with_text'), text),
      el('label', {}, check, ` ${t('marked_only')}`),
      el('button', {type: 'button', onclick: () => { kept.all = []; refresh(); }}, t('clear')), info),
    drives, scroller);
}

function buildDrives() {
  parts.table.classList.toggle('one-bus', buses().length < 2);
  fit();
  const there = new Set(store.drives.map(({bus, id}) => driveKey(bus, id)));
  for (const key of filter.drives) if (!there.has(key)) filter.drives.delete(key);
  const toggle = (bus, id) => {
    if (!filter.drives.delete(driveKey(bus, id))) filter.drives.add(driveKey(bus, id));
    showDrives();
  };
  parts.drives.replaceChildren(el('span', {class: 'dim', text: t('drives')}), ...driveGroups(toggle),
    el('button', {type: 'button', onclick: () => { filter.drives.clear(); showDrives(); }}, t('all')));
  showDrives();
}

function showDrives() {
  showPressed(parts.drives, (key) => filter.drives.has(key));
  refresh();
}

export function show(yes) {
  visible = yes;
  if (yes && !wasVisible) {
    wasVisible = true;
    open();
  }
  if (!parts) return;
  stale = true;
  run(yes);
}

export function visit(query) {
  const keys = (query.get('drive') ?? '').split(',').filter(driveOf);
  const bus = keys.length ? keys[0].split('/')[0] : query.get('bus');
  if (query.has('drive')) filter.drives = new Set(keys);
  parts.readAddress(query);
  showDrives();
  if (query.has('time_s')) goTo(bus, Number(query.get('time_s')));
}

export const state = () => (parts ? {drive: [...filter.drives], ...parts.state()} : {});

/// Scrolls to the frame of that instant, if still kept, and pauses.
function goTo(bus, time_s) {
  const frame = frameAt(bus, time_s);
  if (!frame) {
    note(t('frame_gone', {time: figures(time_s, 9)}), true);
    return;
  }
  setPaused(true);
  parts.follow = false;
  if (!kept.shown.includes(frame)) parts.clearFields();
  requestAnimationFrame(() => {
    parts.below.style.height = `${kept.shown.length * row_px}px`;
    parts.scroller.scrollTop = Math.max(0, kept.shown.indexOf(frame)) * row_px;
    stale = true;
  });
}

on('program', () => {
  if (!parts) build();
  buildDrives();
  forget();
  refresh();
  open();
  if (visible) show(true);
});
