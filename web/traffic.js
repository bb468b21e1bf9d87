// The traffic: every frame in words, as the program reads it (GET /frames).

import {stream} from './api.js';
import {byId, el, labelled, setText} from './dom.js';
import {drawing} from './drawing.js';
import {fixed} from './format.js';
import {adviceOf} from './advice.js';
import {buses, driveKey, on, store} from './store.js';
import {language, name as nameOf, said, t} from './words.js';

const kMost = 50_000;   // frames kept
const kRow_px = 24;
const kMargin = 12;     // rows drawn beyond what is seen
const kDraw_ms = 80;    // nobody reads faster

let streams = [];
let frames = [];        // oldest first
let shown = [];         // those that pass the filter
let lost = 0;
let listening = false;
let paused = false;
let stale = true;       // the picture
let visible = false;
let wanted = false;
let parts = null;
let drawnAt = 0;
let rows = new Map();    // by frame: those in the table

// --- filter

const filter = {drives: new Set(), commands: null, from: '', marked: false, text: ''};

function passes(frame) {
  if (filter.drives.size && !filter.drives.has(frame.id) && frame.id !== 0) return false;
  if (filter.from && frame.from !== filter.from) return false;
  if (filter.marked && !frame.mark && !frame.advice) return false;
  if (filter.commands && !filter.commands.has(frame.command)) return false;
  return !filter.text || `${frame.name} ${frame.values} ${frame.frame}`.toLowerCase().includes(filter.text);
}

function refilter() {
  rows = new Map();  // the gap to the one before is another
  shown = frames.filter(passes);
  stale = true;
}

/// "9C, a4 0xA2": command bytes, or nothing.
function readCommands(text) {
  const list = text.toUpperCase().split(/[\s,]+/).map((one) => one.replace(/^0X/, '')).filter(Boolean);
  return list.length ? new Set(list) : null;
}

// --- what comes

function take(bus, message) {
  if (!listening) stale = listening = true;
  if (message.lost) lost = message.lost;
  if (paused || !message.frames) return;
  for (const frame of message.frames) {
    frame.bus = bus;
    frames.push(frame);
    if (passes(frame)) shown.push(frame);
  }
  if (frames.length > kMost * 1.2) {
    frames = frames.slice(-kMost);
    shown = frames.filter(passes);
  }
  stale = true;
}

/// From the first time on that somebody looks: it is work for the program too.
function open() {
  if (!wanted || !store.status) return;
  streams.forEach((one) => one.close());
  frames = [];
  shown = [];
  lost = 0;
  streams = buses().map(({bus}) => stream(`/frames?bus=${encodeURIComponent(bus)}`, {onMessage: (message) => take(bus, message)}));
}

// --- what is seen

/// No more figures than people read; all of them when the mouse rests there.
const short = (values) => values.replace(/-?\d+\.\d{4,}/g, (number) => String(Number(Number(number).toPrecision(4))));

/// The program says it in English; a command is known by its byte, if it means anything at all.
const nameOfFrame = (frame) => (language !== 'en' && frame.name ? nameOf('commands', frame.command) : frame.name);

function row(frame, before) {
  const gap = before ? frame.time_s - before.time_s : null;
  const whom = frame.id ? `drive=${driveKey(frame.bus, frame.id)}&` : '';  // else whatever the scope shows
  const scope = el('a', {href: `#scope?${whom}time_s=${frame.time_s}`,
    'aria-label': t('instant_in_scope', {time: fixed(frame.time_s, 6)}), text: t('scope_link')});
  const known = frame.advice ? adviceOf(frame.bus, frame.id, frame.advice) : null;
  return el('tr', {class: `${frame.from} ${frame.mark ?? ''} ${frame.advice ? 'advised' : ''}`},
    el('td', {class: 'num', text: fixed(frame.time_s, 6)}), el('td', {class: 'num dim', text: gap === null ? '' : fixed(gap * 1000, 3)}),
    el('td', {text: buses().length > 1 ? frame.bus : ''}),
    el('td', {text: frame.from === 'host' ? `→ ${frame.id || t('to_all')}` : `← ${frame.id || '?'}`}),
    el('td', {class: 'mono', text: frame.command}), el('td', {text: nameOfFrame(frame), title: nameOfFrame(frame)}),
    el('td', {class: 'said', title: frame.values}, frame.advice ? el('span', {class: 'chip warn', title: known ? said(known, 'what') : '', text: frame.advice}) : '', frame.values ? ` ${short(frame.values)}` : '',
      frame.drawback ? el('strong', {text: ` ${nameOf('marks', frame.drawback)}`}) : ''),
    el('td', {class: 'mono dim', text: frame.frame}), el('td', {}, scope));
}

/// A row that stays is not touched: whoever is about to click it still finds it.
function showRows(body, first, last) {
  const before = rows;
  rows = new Map();
  for (let n = first; n < last; ++n) rows.set(shown[n], before.get(shown[n]) ?? row(shown[n], shown[n - 1]));
  const wanted = [...rows.values()];
  const there = new Set(wanted);
  for (const old of [...body.children]) if (!there.has(old)) old.remove();
  wanted.forEach((one, n) => {
    if (body.children[n] !== one) body.insertBefore(one, body.children[n] ?? null);
  });
}

/// Only the rows that can be seen are there.
const run = drawing((at) => {
  if (!stale || (!parts.scrolled && at - drawnAt < kDraw_ms)) return;
  stale = parts.scrolled = false;
  drawnAt = at;
  const {scroller, body, above, below, info} = parts;
  const following = !paused && parts.follow;
  const fits = Math.ceil(scroller.clientHeight / kRow_px);
  const top = following ? Math.max(0, shown.length - fits + 1) : Math.floor(scroller.scrollTop / kRow_px);
  const first = Math.max(0, top - kMargin);
  const last = Math.min(shown.length, top + fits + kMargin);
  above.style.height = `${first * kRow_px}px`;
  below.style.height = `${(shown.length - last) * kRow_px}px`;
  showRows(body, first, last);
  parts.table.setAttribute('aria-rowcount', shown.length);
  if (following) scroller.scrollTop = scroller.scrollHeight;
  if (listening) setText(info, t('frames_info', {shown: shown.length, all: frames.length}) + (lost ? t('frames_lost', {n: lost}) : ''));
});

function setPaused(yes) {
  paused = yes;
  setText(parts.pause, yes ? t('go_on') : t('pause'));
  parts.pause.setAttribute('aria-pressed', yes);
  if (!yes) parts.follow = true;
  stale = true;
}

function build() {
  const check = el('input', {type: 'checkbox', onchange: () => { filter.marked = check.checked; refilter(); }});
  // Not all that empties a field tells of an input.
  const readFields = () => {
    filter.commands = readCommands(commands.value);
    filter.text = text.value.toLowerCase();
    refilter();
  };
  const commands = el('input', {type: 'text', size: 12, placeholder: '9C, A4', oninput: readFields, onchange: readFields});
  const text = el('input', {type: 'search', size: 16, placeholder: t('any_text'), oninput: readFields, onchange: readFields});
  const from = el('select', {onchange: () => { filter.from = from.value; refilter(); }},
    el('option', {value: '', text: t('both_ways')}), el('option', {value: 'host', text: t('queries')}), el('option', {value: 'drive', text: t('replies_only')}));
  const pause = el('button', {type: 'button', class: 'main', 'aria-pressed': 'false', onclick: () => setPaused(!paused)}, t('pause'));
  const info = el('span', {class: 'dim', id: 'traffic-info'});
  const drives = el('div', {class: 'row picks', role: 'group', 'aria-label': t('drives')});
  const body = el('tbody');
  const above = el('div');
  const below = el('div');
  const table = el('table', {'aria-label': t('frames_label')},
    el('colgroup', {}, ...['time', 'gap', 'bus', 'way', 'command', 'name', 'said', 'frame', 'scope'].map((name) => el('col', {class: `c-${name}`}))),
    el('thead', {}, el('tr', {}, ...[t('head_time'), t('head_gap'), '', t('head_way'), t('head_command'), t('head_name'), t('head_says'), t('head_frame'), ''].map((head, n) =>
      el('th', {scope: 'col', class: n < 2 ? 'num' : '', text: head})))), body);
  const scroller = el('div', {class: 'frames', tabindex: 0, 'aria-label': t('frames_scroller')}, above, table, below);
  scroller.addEventListener('scroll', () => {
    parts.follow = scroller.scrollTop + scroller.clientHeight > scroller.scrollHeight - 2 * kRow_px;
    stale = parts.scrolled = true;
  });
  scroller.addEventListener('wheel', (event) => { if (event.deltaY < 0) parts.follow = false; }, {passive: true});
  parts = {pause, info, drives, body, above, below, table, scroller, follow: true, scrolled: false, commands};
  byId('view-traffic').replaceChildren(
    el('div', {class: 'row'}, pause, labelled(t('show'), from), labelled(t('commands'), commands), labelled(t('with_text'), text),
      el('label', {}, check, ` ${t('marked_only')}`),
      el('button', {type: 'button', onclick: () => { frames = []; refilter(); }}, t('clear')), info),
    drives, scroller);
}

function buildDrives() {
  parts.table.classList.toggle('one-bus', buses().length < 2);
  const ids = [...new Set(store.drives.map((drive) => drive.id))];
  const buttons = ids.map((id) => el('button', {type: 'button', 'aria-pressed': filter.drives.has(id), 'data-id': id,
    onclick: () => { if (!filter.drives.delete(id)) filter.drives.add(id); buildDrives(); refilter(); }}, String(id)));
  parts.drives.replaceChildren(el('span', {class: 'dim', text: t('drives')}), ...buttons,
    el('button', {type: 'button', onclick: () => { filter.drives.clear(); buildDrives(); refilter(); }}, t('all')));
}

export function show(yes) {
  visible = yes;
  if (!parts) return;
  if (yes && !wanted) {
    wanted = true;
    open();
  }
  stale = true;
  run(yes);
}

export function visit(query) {
  const id = Number((query.get('drive') ?? '').split('/')[1]);
  if (id) filter.drives = new Set([id]);
  buildDrives();
  refilter();
  if (query.has('time_s')) goTo(Number(query.get('time_s')));
}

/// The frame of that instant on top, as far as it is still here; what comes later does not move it.
function goTo(time_s) {
  setPaused(true);
  parts.follow = false;
  requestAnimationFrame(() => {
    const place = shown.findIndex((frame) => frame.time_s >= time_s - 1e-9);
    parts.below.style.height = `${shown.length * kRow_px}px`;
    parts.scroller.scrollTop = Math.max(0, place) * kRow_px;
    stale = true;
  });
}

on('program', () => {
  if (!parts) build();
  buildDrives();
  open();
  if (visible) show(true);
});
