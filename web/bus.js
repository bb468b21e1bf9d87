// The bus at a glance: a card for each drive.

import {advicePanel} from './advice.js';
import {Dial, shaftOf} from './dial.js';
import {byId, el, setText} from './dom.js';
import {drawing} from './drawing.js';
import {fixed} from './format.js';
import {liveValues, wantLive} from './live.js';
import {driveKey, driveName, driveOf, on, store} from './store.js';
import {name as nameOf, t} from './words.js';

const kNumbers_ms = 120;   // between changes of numbers: people have to read them
const kSpoken_ms = 1500;   // and those who listen have to hear them

const kDense = 12;         // drives on one screen in full size

const cards = new Map();
let summary = null;

function field(name, unit, title) {
  const value = el('dd', {text: '–'});
  return {node: el('div', {title}, el('dt', {text: name}), value, el('span', {class: 'unit', text: unit})), value};
}

function makeCard(drive) {
  const name = driveName(drive.bus, drive.id);
  const dial = new Dial({label: t('drive', {name})});
  const fields = {
    speed: field(t('speed'), '°/s', t('speed_about')),
    current: drive.series === 'MS' ? field(t('power_share'), '%', t('unit_power')) : field(t('current'), 'A', t('current_about')),
    voltage: field(t('voltage'), 'V', t('voltage_about')),
    motor: field(t('motor'), '°C', t('motor_about')),
    stage: field(t('stage'), '°C', t('stage_about')),
    replies: field(t('replies'), t('per_second'), t('replies_about')),
  };
  const state = el('span', {class: 'chip'});
  const errors = el('p', {class: 'errors'});
  const root = el('article', {class: 'card', 'aria-label': t('drive', {name}), 'data-drive': driveKey(drive.bus, drive.id)},
    el('header', {}, el('h2', {text: name}), el('span', {class: 'dim model', text: drive.model}), state),
    dial.root, el('dl', {class: 'fields'}, ...Object.values(fields).map((one) => one.node)), errors,
    el('footer', {}, el('a', {href: `#scope?drive=${driveKey(drive.bus, drive.id)}`, 'aria-label': t('scope_of', {name})}, t('scope_link')),
      el('a', {href: `#bench?drive=${driveKey(drive.bus, drive.id)}`, 'aria-label': t('bench_of', {name})}, t('bench_link')),
      el('a', {href: `#traffic?drive=${driveKey(drive.bus, drive.id)}`, 'aria-label': t('traffic_of', {name})}, t('traffic_link'))));
  return {root, dial, fields, state, errors};
}

function build() {
  cards.clear();
  for (const drive of store.drives) cards.set(driveKey(drive.bus, drive.id), makeCard(drive));
  summary = el('p', {class: 'dim', id: 'bus-summary'});
  byId('view-bus').replaceChildren(el('div', {class: 'row bus-head'}, summary, advicePanel()), el('div', {class: cards.size > kDense ? 'cards dense' : 'cards'}, ...[...cards.values()].map((card) => card.root)));
}

function showNumbers(card, drive, now) {
  const {fields} = card;
  setText(fields.speed.value, fixed(now.speed_dps, 1));
  setText(fields.current.value, drive.series === 'MS' ? fixed(now.power * 100, 1) : fixed(now.iq_A, 2));
  setText(fields.voltage.value, fixed(now.voltage_V, 2));
  setText(fields.motor.value, fixed(now.temperature_C, 1));
  setText(fields.stage.value, fixed(now.driver_temperature_C, 1));
}

function showState(card, drive) {
  setText(card.state, drive.alive ? t(drive.state) : t('no_power'));
  card.state.className = `chip ${!drive.alive ? 'bad' : drive.state === 'running' ? 'good' : 'warn'}`;
  const text = drive.errors.map((error) => nameOf('errors', error)).join(', ');
  setText(card.errors, text || t('no_errors'));
  card.errors.classList.toggle('bad', text !== '');
  card.root.classList.toggle('dead', !drive.alive);
  setText(card.fields.replies.value, fixed(store.rates.get(driveKey(drive.bus, drive.id)), 0));
}

let numbersAt = 0;
let spokenAt = 0;

const run = drawing((at) => {
  const numbers = at - numbersAt > kNumbers_ms;
  const spoken = at - spokenAt > kSpoken_ms;
  if (numbers) numbersAt = at;
  if (spoken) spokenAt = at;
  for (const [key, card] of cards) {
    const drive = driveOf(key);
    if (!drive) continue;
    const now = liveValues(drive);
    const shaft = shaftOf(drive, now);
    card.dial.show(shaft);
    if (numbers) showNumbers(card, drive, now);
    if (spoken) card.dial.say(shaft);
  }
});

export function show(yes) {
  wantLive(yes);
  run(yes);
}

on('program', build);
function showSummary() {
  if (!summary || !store.status) return;
  const count = (holds) => store.drives.filter(holds).length;
  const replies = store.drives.reduce((sum, {bus, id}) => sum + (store.rates.get(driveKey(bus, id)) ?? 0), 0);
  setText(summary, t('summary', {drives: store.drives.length, running: count((one) => one.alive && one.state === 'running'),
    errors: count((one) => one.errors.length > 0), dead: count((one) => !one.alive), replies: fixed(replies, 0)}));
}

on('change', () => {
  showSummary();
  for (const [key, card] of cards) {
    const drive = driveOf(key);
    if (drive) showState(card, drive);
  }
});
