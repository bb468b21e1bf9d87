// Injection of faults, and the list of their effects.

import {post} from './api.js';
import {el, labelled, setText} from './dom.js';
import {attempt, chosenDrives} from './choice.js';
import {isGoing, onFaults} from './fault_list.js';
import {figures} from './format.js';
import {buses, driveName, store} from './store.js';
import {faultName, language, name as nameOf, said, t} from './words.js';

/// Returns "to, V"; in Chinese the name from the list.
const parameterName = (key) => nameOf('parameters', key).replace(/ (s|ms|us|m|V|A|C|deg|Nm|Nms|Hz|dps)$/, ', $1');
/// Includes the program's own name, which users need for scenarios.
const kindName = (kind) => (language === 'en' ? nameOf('fault_names', kind) : `${nameOf('fault_names', kind)} ${kind}`);

// --- choice of a fault, with its parameters

function input(parameter) {
  if (parameter.choices) {
    return el('select', {}, ...parameter.choices.map((word) => el('option', {value: word, text: nameOf('choices', word), selected: word === parameter.default})));
  }
  return el('input', {type: 'number', step: 'any', min: parameter.min, max: parameter.max, required: parameter.required,
    placeholder: parameter.required ? t('needed') : figures(parameter.default), title: t('from_to', {min: figures(parameter.min), max: figures(parameter.max)})});
}

function timing(kind) {
  const list = [];
  if (kind.per_frame) list.push({name: 'probability', min: 0, max: 1, default: 1});
  if (!kind.momentary) list.push({name: 'for_s', min: 0, max: 1e8, text: t('until_cleared')});
  list.push({name: 'every_s', min: 0.001, max: 1e8, text: t('once')}, {name: 'times', min: 1, max: 1e9, text: t('no_end')});
  return list.map((one) => ({...one, control: el('input', {type: 'number', step: 'any', min: one.min, max: one.max, placeholder: one.text ?? figures(one.default)})}));
}

export function faultPanel() {
  const groups = [...new Set(store.kinds.map((kind) => kind.group))];
  const select = el('select', {id: 'fault-kind', 'aria-label': t('fault')}, ...groups.map((group) => el('optgroup', {label: nameOf('fault_groups', group)},
    ...store.kinds.filter((kind) => kind.group === group).map((kind) => el('option', {value: kind.kind, text: kindName(kind.kind)})))));
  const about = el('p', {class: 'dim about'});
  const form = el('div', {class: 'pairs', id: 'fault-parameters'});
  const inject = el('button', {type: 'button', class: 'main', id: 'fault-inject'}, t('inject'));
  let controls = [];
  const pair = (name, control) => el('label', {class: 'pair'}, el('span', {text: parameterName(name)}), control);
  const choose = () => {
    const kind = store.kinds.find((one) => one.kind === select.value);
    controls = [...kind.parameters.map((parameter) => ({name: parameter.name, control: input(parameter), choices: parameter.choices})), ...timing(kind)];
    for (const {name, control} of controls) control.dataset.key = name;
    form.replaceChildren(...controls.map(({name, control}) => pair(name, control)));
    setText(about, `${said(kind, 'about')}${kind.of_bus ? ` ${t('of_whole_bus')}` : ''}`);
  };
  select.addEventListener('change', choose);
  choose();
  inject.addEventListener('click', () => attempt(() => breakIt(select.value, controls), (names) => t('fault_injected', {names: names.map((name) => faultName(name, select.value)).join(', ')})));
  return [el('div', {class: 'row'}, labelled(t('fault'), select), inject), about, form];
}

async function breakIt(name, controls) {
  const kind = store.kinds.find((one) => one.kind === name);
  const fault = {kind: name};
  for (const {name: key, control, choices} of controls) {
    if (control.value !== '') fault[key] = choices ? control.value : Number(control.value);
  }
  const names = [];
  const drives = chosenDrives();
  if (!kind.of_bus && !drives.length) throw new Error(t('choose_first'));
  for (const {bus} of buses()) {
    const ids = drives.filter((drive) => drive.bus === bus).map((drive) => drive.id);
    if (!kind.of_bus && !ids.length) continue;
    if (kind.of_bus && drives.length && !ids.length) continue;
    const request = kind.of_bus ? {bus, fault} : {bus, ids: ids.join(','), fault};
    names.push(...(await post('/directives', request)).faults);
  }
  return names;
}

// --- list of faults

const kStates = {active: 'bad', armed: 'warn', paused: 'warn', over: '', cleared: ''};

const kUnitNames = {deg: '°', dps: ' °/s', C: ' °C', us: ' µs'};
/// Returns " V" for to_V.
function unitOfParameter(key) {
  const unit = /_(s|ms|us|V|A|C|deg|Nm|Nms|Hz|dps)$/.exec(key)?.[1];
  return unit ? kUnitNames[unit] ?? ` ${unit}` : '';
}

/// Translates the only word in "drive 2, 142#9A00".
const whereOf = ({first_on}) => String(first_on).replace(/^drive (\d+)/, (all, id) => t('drive_label', {name: id}));

/// Returns the texts of the cells of a fault's row.
function cellsOf(fault) {
  const seconds = (s) => (s === null ? '–' : `${figures(s, 7)} s`);
  const parameters = Object.entries(fault.parameters)
    .map(([key, value]) => `${parameterName(key).replace(/[,，] ?\S+$/, '')} ${typeof value === 'number' ? figures(value) : nameOf('choices', value)}${unitOfParameter(key)}`).join(', ');
  return [nameOf('states', fault.state), fault.ids.length ? fault.ids.map((id) => driveName(fault.bus, id)).join(', ') : fault.bus, parameters,
    seconds(fault.began_at_s), seconds(fault.first_effect_at_s), String(fault.effects), fault.effects ? whereOf(fault) : t('nothing_yet')];
}

/// Makes a row once and updates it in place, so that its button keeps the focus.
function makeRow(fault) {
  const name = faultName(fault.name, fault.kind);
  const clear = el('button', {type: 'button', 'aria-label': t('clear_fault', {name}),
    onclick: () => attempt(() => post('/directives', {bus: fault.bus, clear: fault.name}), t('fault_cleared', {name}))}, t('clear'));
  const chip = el('span', {class: 'chip'});
  const cells = [chip, ...Array.from({length: 6}, (_, n) => el('td', {class: n >= 2 && n <= 4 ? 'num' : ''}))];
  const root = el('tr', {'data-fault': fault.name}, el('td', {}, clear), el('th', {scope: 'row', text: name, title: fault.name}), el('td', {}, chip), ...cells.slice(1));
  return {root, show(now) {
    cellsOf(now).forEach((text, n) => setText(cells[n], text));
    chip.className = `chip ${kStates[now.state] ?? ''}`;
    chip.dataset.state = now.state;
    clear.disabled = !isGoing(now);
  }};
}

export function evidencePanel() {
  const body = el('tbody');
  const nothing = el('p', {class: 'dim', text: t('no_faults')});
  const heads = ['name', 'state', 'of', 'parameters', 'began', 'first', 'effects', 'first_on'].map((head) => t(`fault_${head}`));
  const all = el('button', {type: 'button', onclick: () => attempt(async () => {
    for (const {bus} of buses()) await post('/directives', {bus, clear: 'all'});
  }, t('all_cleared'))}, t('clear_all'));
  const rows = new Map();  // by bus and name
  const show = (faults) => {
    const there = new Set(faults.map((fault) => `${fault.bus} ${fault.name}`));
    for (const [key, row] of rows) {
      if (there.has(key)) continue;
      row.root.remove();
      rows.delete(key);
    }
    for (const fault of faults) {
      const key = `${fault.bus} ${fault.name}`;
      if (!rows.has(key)) {
        rows.set(key, makeRow(fault));
        body.prepend(rows.get(key).root);  // the newest on top
      }
      rows.get(key).show(fault);
    }
    nothing.hidden = faults.length > 0;
  };
  onFaults(show, body);
  return [el('div', {class: 'row'}, all, nothing), el('div', {class: 'scroll', tabindex: 0, role: 'group', 'aria-label': t('evidence')}, el('table', {id: 'evidence'}, el('thead', {}, el('tr', {},
    el('td'), ...heads.map((head, n) => el('th', {scope: 'col', class: n >= 4 && n <= 6 ? 'num' : '', text: head})))), body))];
}
