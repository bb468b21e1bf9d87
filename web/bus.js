// The bus at a glance: a card for each drive.

import {Dial, shaftOf} from './dial.js';
import {byId, el, setText} from './dom.js';
import {fixed, words} from './format.js';
import {liveValues, wantLive} from './live.js';
import {driveKey, driveName, driveOf, on, store} from './store.js';

const kNumbers_ms = 120;   // between changes of numbers: people have to read them
const kSpoken_ms = 1500;   // and those who listen have to hear them

const kDense = 12;         // drives on one screen in full size

const cards = new Map();
let visible = false;

function field(name, unit, title) {
  const value = el('dd', {text: '–'});
  return {node: el('div', {title}, el('dt', {text: name}), value, el('span', {class: 'unit', text: unit})), value};
}

function makeCard(drive) {
  const name = driveName(drive.bus, drive.id);
  const dial = new Dial({label: `Drive ${name}`});
  const fields = {
    speed: field('speed', '°/s', 'speed as the drive reports it, of the rotor'),
    current: field(drive.series === 'MS' ? 'power' : 'iq', drive.series === 'MS' ? '%' : 'A', 'torque current, measured'),
    voltage: field('bus', 'V', 'voltage, measured'),
    motor: field('motor', '°C', 'temperature of the motor, measured'),
    stage: field('stage', '°C', 'temperature of the power stage, measured'),
    replies: field('replies', '/s', 'replies in a second of simulated time'),
  };
  const state = el('span', {class: 'chip'});
  const errors = el('p', {class: 'errors'});
  const root = el('article', {class: 'card', 'aria-label': `Drive ${name}`, 'data-drive': driveKey(drive.bus, drive.id)},
    el('header', {}, el('h2', {text: name}), el('span', {class: 'dim model', text: drive.model}), state),
    dial.root, el('dl', {class: 'fields'}, ...Object.values(fields).map((one) => one.node)), errors,
    el('footer', {}, el('a', {href: `#scope?drive=${driveKey(drive.bus, drive.id)}`, 'aria-label': `Scope of drive ${name}`}, 'scope'),
      el('a', {href: `#bench?drive=${driveKey(drive.bus, drive.id)}`, 'aria-label': `Bench of drive ${name}`}, 'bench'),
      el('a', {href: `#traffic?drive=${driveKey(drive.bus, drive.id)}`, 'aria-label': `Traffic of drive ${name}`}, 'traffic')));
  return {root, dial, fields, state, errors};
}

function build() {
  cards.clear();
  for (const drive of store.drives) cards.set(driveKey(drive.bus, drive.id), makeCard(drive));
  byId('view-bus').replaceChildren(el('div', {class: cards.size > kDense ? 'cards dense' : 'cards'}, ...[...cards.values()].map((card) => card.root)));
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
  setText(card.state, drive.alive ? drive.state : 'no power');
  card.state.className = `chip ${!drive.alive ? 'bad' : drive.state === 'running' ? 'good' : 'warn'}`;
  const text = drive.errors.map(words).join(', ');
  setText(card.errors, text || 'no errors');
  card.errors.classList.toggle('bad', text !== '');
  card.root.classList.toggle('dead', !drive.alive);
  setText(card.fields.replies.value, fixed(store.rates.get(driveKey(drive.bus, drive.id)), 0));
}

let numbersAt = 0;
let spokenAt = 0;

function frame(at) {
  if (!visible) return;
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
  requestAnimationFrame(frame);
}

export function show(yes) {
  visible = yes;
  wantLive(yes);
  if (yes) requestAnimationFrame(frame);
}

on('program', build);
on('change', () => {
  for (const [key, card] of cards) {
    const drive = driveOf(key);
    if (drive) showState(card, drive);
  }
});
