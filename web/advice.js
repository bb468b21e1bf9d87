// Mistakes of hosts as the program reports them (GET /advice); hidden if the program has no advice.

import {get} from './api.js';
import {el, setText} from './dom.js';
import {figures} from './format.js';
import {driveKey, driveName, on, store} from './store.js';
import {said, t} from './words.js';

const kAsk_ms = 2000;

let list = [];
let exists = true;   // an older program lacks GET /advice
let asking = false;
let askedAt = -Infinity;
let shown = '';
let panel = null;

/// Returns the advice on a kind of mistake with a drive, or null.
export const adviceOf = (bus, id, kind) => list.find((one) => one.bus === bus && one.kind === kind && one.drive === id)
  ?? list.find((one) => one.kind === kind) ?? null;

function item(one) {
  const whom = one.drive ? t('drive', {name: driveName(one.bus, one.drive)}) : one.bus;
  const times = t('advice_times', {n: one.count, time: figures(one.first_s, 7)});
  const where = one.drive ? `drive=${driveKey(one.bus, one.drive)}` : `bus=${one.bus}`;
  return el('li', {'data-advice': one.kind},
    el('strong', {text: whom}), ' ', el('span', {class: 'chip warn', text: one.kind}), ' ', said(one, 'what'), ' ',
    el('span', {class: 'dim', text: `(${times}, `}), el('span', {class: 'mono dim', text: one.frame}), el('span', {class: 'dim', text: ') '}),
    el('a', {href: `#traffic?${where}&time_s=${one.first_s}`, text: t('advice_frame')}),
    el('p', {}, el('span', {class: 'dim', text: `${t('advice_todo')} `}), said(one, 'todo')));
}

function redraw() {
  if (!panel) return;
  const text = JSON.stringify(list);
  if (text === shown || panel.items.contains(document.activeElement)) return;
  shown = text;
  setText(panel.count, list.length ? `${t('advice')}: ${list.length}` : t('advice'));
  panel.count.className = list.length ? 'chip warn' : '';
  panel.items.replaceChildren(...(list.length ? list.map(item) : [el('li', {class: 'dim', text: t('advice_none')})]));
}

/// Closed by default.
export function advicePanel() {
  panel = {count: el('span', {text: t('advice')}), items: el('ul', {class: 'advice'})};
  panel.root = el('details', {id: 'advice', hidden: true}, el('summary', {title: t('advice_about')}, panel.count), panel.items);
  panel.root.hidden = !exists || shown === '';
  shown = '';
  return panel.root;
}

async function ask() {
  asking = true;
  askedAt = performance.now();
  try {
    list = await get('/advice');
    if (panel) panel.root.hidden = false;
    redraw();
  } catch (problem) {
    exists = problem.status !== 404;
  }
  asking = false;
}

on('program', () => {
  exists = true;
  list = [];
});
on('change', () => {
  if (exists && !asking && store.connected && performance.now() - askedAt > kAsk_ms) ask();
});
