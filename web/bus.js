// The bus view: a card for each drive, grouped by bus.

import {advicePanel} from './advice.js';
import {fitCards} from './card_size.js';
import {Dial, shaftOf} from './dial.js';
import {byId, el, note, setText} from './dom.js';
import {drawing} from './drawing.js';
import {goingOn, onFaults} from './fault_list.js';
import {fitted, fixed} from './format.js';
import {hostWatch} from './host_watch.js';
import {liveValues, wantLive} from './live.js';
import {Spark} from './spark.js';
import {buses, driveKey, driveName, driveOf, on, store} from './store.js';
import {name as nameOf, t} from './words.js';

const kDials_ms = 33;      // between drawings of the dials
const kNumbers_ms = 200;   // between updates of numbers, so that people can read them
const kSpoken_ms = 1500;   // between updates for screen readers

const kCalm = {speed: 10, current: 0.2, power: 10};  // assumed: smaller ranges of °/s, A and % are noise

const cards = new Map();
const heads = new Map();   // by bus: elements of the whole bus
let summary = null;
let groups = null;
let attention = null;
let picked = null;         // key of the drive that was clicked, on its card or its joint
let visible = false;
let robot = null;          // module of the robot's panel, which most pages do not need
let wantedRobot = null;    // part of the address for it

function field(name, unit, title) {
  const value = el('dd', {text: '–'});
  return {node: el('div', {title}, el('dt', {text: name}), value, el('dd', {class: 'unit', text: unit})), value};
}

function makeCard(drive) {
  const name = driveName(drive.bus, drive.id);
  const key = driveKey(drive.bus, drive.id);
  const dial = new Dial({label: t('drive', {name})});
  const figures = {
    speed: field(t('speed'), '°/s', t('speed_about')),
    current: drive.series === 'MS' ? field(t('power_share'), '%', t('unit_power')) : field(t('current'), 'A', t('current_about')),
  };
  const fields = {
    angle: field(t('rotor'), '°', t('rotor_about')),
    voltage: field(t('voltage'), 'V', t('voltage_about')),
    motor: field(t('motor'), '°C', t('motor_about')),
    stage: field(t('stage'), '°C', t('stage_about')),
    replies: field(t('replies'), t('per_second'), t('replies_about')),
  };
  const sparks = {speed: new Spark(kCalm.speed), current: new Spark(drive.series === 'MS' ? kCalm.power : kCalm.current)};
  for (const [name, spark] of Object.entries(sparks)) figures[name].node.append(spark.root);
  fields.angle.node.classList.add('angle');
  const list = (kind, some) => el('dl', {class: `fields ${kind}`}, ...Object.values(some).map((one) => one.node));
  const shaft = el('p', {class: 'shaft-deg', title: t('shaft_about')});
  const state = el('span', {class: 'chip'});
  const errors = el('p', {class: 'errors'});
  const faults = el('p', {class: 'faults', hidden: true});
  const link = (view, label, text) => el('a', {href: `#${view}?drive=${key}`, 'aria-label': label}, text);
  const model = el('span', {class: 'dim model', text: drive.model, title: drive.model});
  const root = el('article', {class: 'card', tabindex: -1, onpointerenter: () => highlight(key), onpointerleave: () => highlight(null),
    onclick: (event) => event.target.closest('a') || pick(key), 'aria-label': t('drive', {name}), 'data-drive': key},
    el('header', {}, el('h2', {text: String(drive.id)}), model, state),
    el('div', {class: 'dial-box'}, dial.root, shaft), list('figures', figures), list('small', fields),
    el('div', {class: 'said'}, errors, faults), el('footer', {}, link('scope', t('scope_of', {name}), t('scope_link')),
      link('bench', t('bench_of', {name}), t('bench_link')), link('traffic', t('traffic_of', {name}), t('traffic_link'))));
  return {root, dial, model, sparks, fields: {...figures, ...fields}, state, errors, faults, shaft};
}

/// Marks a drive's card and its joint; null: those of the clicked drive.
function highlight(key) {
  const shown = key ?? picked;
  for (const [one, {root}] of cards) root.classList.toggle('lit', one === shown && byId('robot') !== null);
  robot?.markDrive(shown);
}

function pick(key) {
  picked = picked === key ? null : key;
  highlight(null);
  cards.get(key)?.root.scrollIntoView({block: 'nearest'});
}

/// Shows the names of the robot's joints in place of the motors' models.
function nameCards(joints) {
  for (const {bus, id, name} of joints) {
    const model = cards.get(driveKey(bus, id))?.model;
    if (!model || !name) continue;
    model.title = `${name}, ${model.title}`;
    setText(model, name);
  }
}

const needsAttention = (drive) => !drive.alive || drive.errors.length > 0;

/// Focuses the next card that needs attention.
function visitAttention() {
  const keys = store.drives.filter(needsAttention).map(({bus, id}) => driveKey(bus, id));
  const at = keys.indexOf(document.activeElement?.dataset.drive ?? visited);
  visited = keys[(at + 1) % keys.length];
  cards.get(visited)?.root.scrollIntoView({block: 'nearest'});
  cards.get(visited)?.root.focus({preventScroll: true, focusVisible: true});
}
let visited = null;  // by visitAttention

function makeGroup({bus, bitrate}) {
  const head = {drives: el('span', {class: 'dim'}), faults: el('span', {class: 'faults'})};
  heads.set(bus, head);
  const mine = store.drives.filter((drive) => drive.bus === bus);
  for (const drive of mine) cards.set(driveKey(bus, drive.id), makeCard(drive));
  const rate = bitrate ? t('bus_rate', {bus, rate: bitrate / 1000}) : t('bus_no_time', {bus});
  return el('section', {class: 'bus-group', 'aria-label': bus, 'data-bus': bus},
    el('header', {class: 'row'}, buses().length > 1 ? el('h2', {text: bus, title: rate}) : '', head.drives, head.faults),
    el('div', {class: 'cards'}, ...mine.map(({id}) => cards.get(driveKey(bus, id)).root)));
}

function build() {
  cards.clear();
  heads.clear();
  picked = null;
  attention = el('button', {type: 'button', id: 'attention', hidden: true, title: t('attention_about'), onclick: visitAttention});
  summary = el('p', {class: 'dim', id: 'bus-summary'});
  groups = el('div', {id: 'bus-groups'}, ...buses().map(makeGroup));
  const rest = el('div', {}, groups);
  byId('view-bus').replaceChildren(el('div', {class: 'row bus-head'}, attention, summary, hostWatch(), advicePanel()), rest);
  if (robot || store.status.body) addRobot(rest).catch((problem) => note(problem.message, true));
  fitCards(groups);
  onFaults(showFaults, groups);
}

async function addRobot(rest) {
  robot ??= await import('./robot.js');
  const panel = robot.robotPanel({onJoints: nameCards, onPoint: highlight, onPick: pick});
  rest.className = panel ? 'with-robot' : '';
  if (panel) rest.prepend(panel);
  if (wantedRobot) robot.visitRobot(wantedRobot);
  robot.showRobot(visible);
  fitCards(groups);
}

/// Without power a controller measures nothing; its sensor values would be noise.
function showNumbers(card, drive, now, shaft) {
  const {fields} = card;
  const measured = (value, digits) => (drive.alive ? fitted(value, digits) : '–');
  setText(card.shaft, t('shaft_deg', {deg: fitted(shaft.shaft, 1)}));
  setText(fields.angle.value, measured(now.angle_deg, 1));
  setText(fields.speed.value, measured(now.speed_dps, 1));
  setText(fields.current.value, drive.series === 'MS' ? measured(now.power * 100, 1) : measured(now.iq_A, 2));
  setText(fields.voltage.value, measured(now.voltage_V, 2));
  setText(fields.motor.value, measured(now.temperature_C, 1));
  setText(fields.stage.value, measured(now.driver_temperature_C, 1));
}

function showSparks({sparks}, drive, now, at_ms) {
  const measured = (value) => (drive.alive ? value : NaN);
  sparks.speed.add(at_ms, measured(now.speed_dps));
  sparks.current.add(at_ms, measured(drive.series === 'MS' ? now.power * 100 : now.iq_A));
}

function showState(card, drive) {
  setText(card.state, drive.alive ? t(drive.state) : t('no_power'));
  card.state.className = `chip ${!drive.alive ? 'bad' : drive.state === 'running' ? 'good' : 'warn'}`;
  const text = drive.errors.map((error) => nameOf('errors', error)).join(', ');
  setText(card.errors, text || t('no_errors'));
  card.errors.classList.toggle('bad', text !== '');
  card.root.classList.toggle('dead', !drive.alive);
  card.root.classList.toggle('wrong', text !== '');
  setText(card.fields.replies.value, fitted(store.rates.get(driveKey(drive.bus, drive.id)), 0));
}

/// Returns "jam, drop (armed)": injected faults, independent of the drive's own errors.
const inWords = (faults) => faults.map(({kind, state}) =>
  (state === 'active' ? nameOf('fault_names', kind) : t('fault_in_state', {name: nameOf('fault_names', kind), state: nameOf('states', state)}))).join(', ');

function say(node, faults) {
  node.hidden = !faults.length;
  if (faults.length) setText(node, t('faults_here', {names: inWords(faults)}));
}

function showFaults() {
  for (const {bus, id} of store.drives) {
    const card = cards.get(driveKey(bus, id));
    if (!card) continue;
    const mine = goingOn(bus, id);
    say(card.faults, mine);
    card.root.classList.toggle('faulty', mine.length > 0);
  }
  for (const [bus, head] of heads) say(head.faults, goingOn(bus));
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
    if (numbers) {
      showNumbers(card, drive, now, shaft);
      if (store.rates.get('clock') > 0) showSparks(card, drive, now, at);
    }
    if (spoken) card.dial.say(shaft);
  }
}, () => kDials_ms);

export function show(yes) {
  visible = yes;
  wantLive(yes);
  run(yes);
  robot?.showRobot(yes);
  if (yes && groups) fitCards(groups);
}

export const state = () => robot?.robotState() ?? Object.fromEntries(wantedRobot ?? []);

export function visit(query) {
  wantedRobot = query;
  robot?.visitRobot(query);
}

const repliesOf = (drives) => drives.reduce((sum, {bus, id}) => sum + (store.rates.get(driveKey(bus, id)) ?? 0), 0);

const counted = (drives) => t(drives.length === 1 ? 'drives_one' : 'drives_many', {n: drives.length});

function showSummary() {
  if (!summary || !store.status) return;
  const count = (holds) => store.drives.filter(holds).length;
  const urgent = count(needsAttention);
  attention.hidden = urgent === 0;
  setText(attention, t(urgent === 1 ? 'attention_one' : 'attention', {n: urgent, drives: counted(store.drives)}));
  setText(summary, t('summary', {drives: counted(store.drives), running: count((one) => one.alive && one.state === 'running'),
    errors: count((one) => one.errors.length > 0), dead: count((one) => !one.alive), replies: fixed(repliesOf(store.drives), 0)}));
  for (const {bus} of buses().length > 1 ? buses() : []) {
    const mine = store.drives.filter((drive) => drive.bus === bus);
    setText(heads.get(bus).drives, t('bus_summary', {drives: counted(mine), replies: fixed(repliesOf(mine), 0)}));
  }
}

on('program', build);
on('change', () => {
  showSummary();
  for (const [key, card] of cards) {
    const drive = driveOf(key);
    if (drive) showState(card, drive);
  }
});
