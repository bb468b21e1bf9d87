// Everything that can break, and what came of it.

import {get, post} from './api.js';
import {el, labelled, setText} from './dom.js';
import {attempt, chosenDrives} from './choice.js';
import {figures, words} from './format.js';
import {buses, driveName, store} from './store.js';

const kEvidence_ms = 700;

// --- one to be chosen, with its parameters

function input(parameter) {
  if (parameter.choices) {
    return el('select', {}, ...parameter.choices.map((word) => el('option', {value: word, text: words(word), selected: word === parameter.default})));
  }
  return el('input', {type: 'number', step: 'any', min: parameter.min, max: parameter.max, required: parameter.required,
    placeholder: parameter.required ? 'needed' : figures(parameter.default), title: `${figures(parameter.min)} to ${figures(parameter.max)}`});
}

function timing(kind) {
  const list = [];
  if (kind.per_frame) list.push({name: 'probability', min: 0, max: 1, default: 1});
  if (!kind.momentary) list.push({name: 'for_s', min: 0, max: 1e8, text: 'until cleared'});
  list.push({name: 'every_s', min: 0.001, max: 1e8, text: 'once'}, {name: 'times', min: 1, max: 1e9, text: 'no end'});
  return list.map((one) => ({...one, control: el('input', {type: 'number', step: 'any', min: one.min, max: one.max, placeholder: one.text ?? figures(one.default)})}));
}

export function faultPanel() {
  const groups = [...new Set(store.kinds.map((kind) => kind.group))];
  const select = el('select', {id: 'fault-kind', 'aria-label': 'fault'}, ...groups.map((group) => el('optgroup', {label: group},
    ...store.kinds.filter((kind) => kind.group === group).map((kind) => el('option', {value: kind.kind, text: words(kind.kind)})))));
  const about = el('p', {class: 'dim about'});
  const form = el('div', {class: 'pairs', id: 'fault-parameters'});
  const inject = el('button', {type: 'button', class: 'main', id: 'fault-inject'}, 'Break it');
  let controls = [];
  const pair = (name, control) => el('div', {class: 'pair'}, el('label', {}, words(name).replace(/ (s|ms|V|A|C|deg|Nm|Hz|dps)$/, ', $1'), control));
  const choose = () => {
    const kind = store.kinds.find((one) => one.kind === select.value);
    controls = [...kind.parameters.map((parameter) => ({name: parameter.name, control: input(parameter), choices: parameter.choices})), ...timing(kind)];
    for (const {name, control} of controls) control.dataset.key = name;
    form.replaceChildren(...controls.map(({name, control}) => pair(name, control)));
    setText(about, `${kind.about}${kind.of_bus ? ' (of the whole bus)' : ''}`);
  };
  select.addEventListener('change', choose);
  choose();
  inject.addEventListener('click', () => attempt(() => breakIt(select.value, controls), (names) => `${names.join(', ')} set`));
  return [el('div', {class: 'row'}, labelled('fault', select), inject), about, form];
}

async function breakIt(name, controls) {
  const kind = store.kinds.find((one) => one.kind === name);
  const fault = {kind: name};
  for (const {name: key, control, choices} of controls) {
    if (control.value !== '') fault[key] = choices ? control.value : Number(control.value);
  }
  const names = [];
  const drives = chosenDrives();
  if (!kind.of_bus && !drives.length) throw new Error('choose a drive first');
  for (const {bus} of buses()) {
    const ids = drives.filter((drive) => drive.bus === bus).map((drive) => drive.id);
    if (!kind.of_bus && !ids.length) continue;
    if (kind.of_bus && drives.length && !ids.length) continue;
    const request = kind.of_bus ? {bus, fault} : {bus, ids: ids.join(','), fault};
    names.push(...(await post('/directives', request)).faults);
  }
  return names;
}

// --- what there has been

const kStates = {active: 'bad', armed: 'warn', paused: 'warn', over: '', cleared: ''};

function row(fault) {
  const seconds = (s) => (s === null ? '–' : `${figures(s, 7)} s`);
  const going = ['active', 'armed', 'paused'].includes(fault.state);
  const said = Object.entries(fault.parameters).map(([key, value]) => `${words(key)} ${typeof value === 'number' ? figures(value) : words(value)}`).join(', ');
  const clear = el('button', {type: 'button', 'aria-label': `clear ${fault.name}`,
    onclick: () => attempt(() => post('/directives', {bus: fault.bus, clear: fault.name}), `${fault.name} cleared`)}, 'Clear');
  return el('tr', {'data-fault': fault.name}, el('th', {scope: 'row'}, fault.name), el('td', {}, el('span', {class: `chip ${kStates[fault.state] ?? ''}`, text: fault.state})),
    el('td', {text: fault.ids.length ? fault.ids.map((id) => driveName(fault.bus, id)).join(', ') : fault.bus}), el('td', {text: said}),
    el('td', {class: 'num', text: seconds(fault.began_at_s)}), el('td', {class: 'num', text: seconds(fault.first_effect_at_s)}),
    el('td', {class: 'num', text: String(fault.effects)}), el('td', {text: fault.effects ? String(fault.first_on) : 'nothing yet'}), el('td', {}, going ? clear : ''));
}

export function evidencePanel() {
  const body = el('tbody');
  const heads = ['name', 'state', 'of', 'parameters', 'began', 'first effect', 'effects', 'first on', ''];
  const all = el('button', {type: 'button', onclick: () => attempt(async () => {
    for (const {bus} of buses()) await post('/directives', {bus, clear: 'all'});
  }, 'everything is whole again')}, 'Clear all');
  let before = '';
  let busy = false;
  const timer = setInterval(async () => {
    if (!body.isConnected) clearInterval(timer);
    if (busy || !store.connected || !body.isConnected || body.closest('[hidden]')) return;
    busy = true;
    try {
      const faults = await get('/faults');
      const text = JSON.stringify(faults);
      if (text !== before && !body.contains(document.activeElement)) {
        before = text;
        body.replaceChildren(...faults.reverse().map(row));
      }
    } catch { /* the next time */ }
    busy = false;
  }, kEvidence_ms);
  return [el('div', {class: 'row'}, all), el('div', {class: 'scroll'}, el('table', {id: 'evidence'}, el('thead', {}, el('tr', {},
    ...heads.map((head, n) => el('th', {scope: 'col', class: n >= 4 && n <= 6 ? 'num' : '', text: head})))), body))];
}
