// A shaft that the user can turn.

import {Dial, shaftOf} from './dial.js';
import {el, note, setText} from './dom.js';
import {drawing} from './drawing.js';
import {fixed} from './format.js';
import {attempt, chosenDrives, onChoice} from './choice.js';
import {post} from './api.js';
import {liveValues} from './live.js';
import {driveKey, driveName, driveOf, on, store} from './store.js';
import {t} from './words.js';

let dial = null;
let drive = null;
let numbers = null;
let owed_deg = 0;     // turned by the user, not yet sent
let telling = false;

/// Sends the accumulated turn each time the program has answered the previous request.
async function tellTurns() {
  if (telling) return;
  telling = true;
  while (Math.abs(owed_deg) > 1e-3 && drive) {
    const turn_deg = Number(owed_deg.toFixed(3));
    owed_deg = 0;
    const {bus, id} = drive;
    if (!await attempt(() => post('/directives', {bus, id, turn_deg}))) break;
  }
  telling = false;
}

/// Returns whether turning is possible; if not, shows why.
function mayTurn() {
  if (store.mayWrite && store.connected && drive) return true;
  note(t(!store.mayWrite ? 'page_only_looks' : store.connected ? 'choose_first' : 'lost'), true);
  return false;
}

function turn(degrees) {
  owed_deg += degrees;
  tellTurns();
}

const kRows = [[t('rotor'), 'angle_deg', 2, '°', t('rotor_about')], [t('speed'), 'speed_dps', 1, '°/s'], [t('current'), 'iq_A', 2, 'A'], [t('voltage'), 'voltage_V', 2, 'V'],
  [t('supply_current'), 'bus_current_A', 2, 'A'], [t('motor'), 'temperature_C', 1, '°C'], [t('stage'), 'driver_temperature_C', 1, '°C']];

const kNoShaft = {shaft: 0, target: null, zero: 0, speed: 0, alive: false, bridge: false};

function choose() {
  const first = chosenDrives()[0];
  drive = first ?? null;
  owed_deg = 0;
  setText(numbers.name, first ? t('drive', {name: driveName(first.bus, first.id)}) : t('no_drive'));
  numbers.at = 0;
  if (!first) showNone();
}

function showNone() {
  dial.show(kNoShaft);
  for (const cell of [numbers.angle, numbers.target, ...numbers.cells]) setText(cell, '–');
}

/// Starts when the panel exists.
export const showShaft = drawing((at) => {
  const current = drive && driveOf(driveKey(drive.bus, drive.id));
  if (!current) return;
  const now = liveValues(current);
  const shaft = shaftOf(current, now);
  dial.show(shaft);
  if (at - numbers.at < 120) return;
  numbers.at = at;
  dial.say(shaft);
  setText(numbers.angle, fixed(shaft.shaft, 2));
  setText(numbers.target, fixed(shaft.target, 2));
  kRows.forEach(([, key, digits], n) => setText(numbers.cells[n], current.alive ? fixed(now[key], digits) : '–'));
});

export function shaftPanel() {
  const mine = new Dial({onTurn: turn, mayTurn, label: t('shaft_by_hand')});
  dial = mine;
  on('change', () => mine.root.setAttribute('aria-disabled', !store.mayWrite || !store.connected), mine.root);
  const row = (name, value, unit, title) => el('div', {title}, el('dt', {text: name}), value, el('dd', {class: 'unit', text: unit}));
  numbers = {at: 0, name: el('h3'), angle: el('dd', {text: '–'}), target: el('dd', {text: '–'}), cells: kRows.map(() => el('dd', {text: '–'}))};
  onChoice(choose);
  choose();
  return [el('div', {class: 'shaft-panel'}, dial.root, el('div', {}, numbers.name,
    el('dl', {class: 'fields'}, row(t('shaft_angle'), numbers.angle, '°', t('shaft_about')), row(t('target_angle'), numbers.target, '°'), ...kRows.map(([name, , , unit, title], n) => row(name, numbers.cells[n], unit, title))),
    el('p', {class: 'dim', text: t('drag_hint')})))];
}
