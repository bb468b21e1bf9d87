// Supply, ambient temperature and load of the chosen drives.

import {el, labelled, setText} from './dom.js';
import {get} from './api.js';
import {chosenDrives, direct, onChoice} from './choice.js';
import {numbersOf} from './fields.js';
import {figures} from './format.js';
import {driveName, on} from './store.js';
import {t} from './words.js';

const plain = (value) => String(Number(value.toPrecision(6)));  // format for input fields
const number = (attributes) => el('input', {type: 'number', step: 'any', ...attributes});
const button = (text, onclick, attributes = {}) => el('button', {type: 'button', onclick, ...attributes}, text);

/// Fields show the present values until the user edits them; `says` always shows the present values.
function follow(inputs, says, show, sentence) {
  const say = () => {
    const drive = chosenDrives()[0];
    setText(says, drive?.surroundings ? sentence(driveName(drive.bus, drive.id), drive.surroundings) : t('no_drive_chosen'));
  };
  const restore = () => {
    const now = chosenDrives()[0]?.surroundings;
    if (now) show(now);
    for (const input of inputs) {
      delete input.dataset.edited;
      if (!now) input.value = '';
    }
    say();
  };
  for (const input of inputs) {
    for (const event of ['input', 'change']) input.addEventListener(event, () => { input.dataset.edited = ''; });
  }
  onChoice(restore);
  restore();
  on('change', () => {
    say();
    const drive = chosenDrives()[0];
    if (!drive?.surroundings) return;
    if (inputs.every((input) => !('edited' in input.dataset) && input !== document.activeElement)) show(drive.surroundings);
  }, says);
  return restore;
}

/// Marks these fields as unedited, unless the user has edited them again.
function settled(values) {
  for (const [input, value] of values) if (input.value === value) delete input.dataset.edited;
}

export function supplyPanel() {
  const supply = number({min: 0, max: 100, value: 24, 'aria-label': t('supply_label')});
  const ramp = number({min: 0, value: 0, 'aria-label': t('within_label')});
  const sag = number({min: 0, max: 100, value: 12, 'aria-label': t('sag_to_label')});
  const sagFor = number({min: 0, value: 0.1, 'aria-label': t('sag_for_label')});
  const off = number({min: 0, value: 0.5, 'aria-label': t('off_for_label')});
  const ambient = number({min: -40, max: 125, value: 25, 'aria-label': t('ambient_label')});
  const says = el('p', {class: 'dim', id: 'supply-now'});
  follow([supply, ambient], says, (now) => {
    supply.value = plain(now.supply_V);
    ambient.value = plain(now.ambient_C);
  }, (name, now) => t('now_supplied', {name, power: t(`now_${now.power}`), V: figures(now.supply_V), C: figures(now.ambient_C)}));
  /// Sends the directive that `make` returns for the numbers in these fields.
  const set = async (inputs, make, done) => {
    const numbers = numbersOf(...inputs);
    const wanted = new Map(inputs.map((input) => [input, input.value]));
    if (numbers && await direct(make(...numbers), done)) settled(wanted);
  };
  const setSupply = () => set([supply, ramp], (supply_V, ramp_s) => ({supply_V, ramp_s}), t('supply_goes', {V: supply.value}));
  const setSag = () => set([sag, sagFor], (sag_to_V, sag_s) => ({sag_to_V, sag_s}), t('sag_done', {V: sag.value}));
  const setAmbient = () => set([ambient], (ambient_C) => ({ambient_C}), t('ambient_is', {C: ambient.value}));
  const cycle = () => set([off], (off_s) => ({power: 'cycle', off_s}), t('power_cycled', {s: off.value}));
  return [says,
    el('div', {class: 'row', role: 'group', 'aria-label': t('power')}, button(t('power_on'), () => direct({power: 'on'}, t('power_is_on'))),
      button(t('power_off'), () => direct({power: 'off'}, t('power_is_off')), {class: 'danger'}), button(t('cycle'), cycle), labelled(t('off_for'), off), ' s'),
    el('div', {class: 'row'}, labelled(t('supply'), supply), 'V', labelled(t('within'), ramp), 's',
      button(t('set'), setSupply, {'aria-label': t('set_supply')})),
    el('div', {class: 'row'}, labelled(t('sag_to'), sag), 'V', labelled(t('sag_for'), sagFor), 's',
      button(t('sag'), setSag)),
    el('div', {class: 'row'}, labelled(t('ambient'), ambient), '°C', button(t('set'), setAmbient, {'aria-label': t('set_ambient')})),
  ];
}

const kLoad = [
  ['J_g_cm2', 'inertia', 'g·cm²', 'inertia_about'],
  ['tau_Nm', 'torque', 'Nm', 'torque_about'],
  ['tau_gravity_Nm', 'gravity', 'Nm', 'gravity_about'],
  ['theta_min_deg', 'stop_from', '°', 'stop_about'],
  ['theta_max_deg', 'stop_to', '°', 'stop_about'],
];
const kNoStop = 1e6;
const isStop = (key) => key.startsWith('theta');
const isThere = (key, load) => !isStop(key) || Math.abs(load[key] ?? NaN) < kNoStop;

export function loadPanel() {
  const inputs = kLoad.map(([key, , , title]) => number({id: `load-${key}`, title: t(title), 'data-key': key}));
  const says = el('p', {class: 'dim', id: 'load-now'});
  const restore = follow(inputs, says, ({load}) => kLoad.forEach(([key], n) => {
    inputs[n].value = isThere(key, load) ? plain(load[key]) : '';
  }), (name, {load}) => t('load_now', {name, text: kLoad.filter(([key]) => isThere(key, load))
    .map(([key, word, unit]) => `${t(word)} ${figures(load[key])} ${unit}`).join(', ')}));
  const mayBeEmpty = (input) => isStop(input.dataset.key) && !input.validity.badInput;
  /// A load directive replaces the whole load, so unedited values are sent again. An empty field means no end stop.
  const set = async () => {
    const edited = inputs.filter((input) => 'edited' in input.dataset);
    if (!numbersOf(...edited.filter((input) => input.value !== '' || !mayBeEmpty(input)))) return;
    const wanted = new Map(edited.map((input) => [input, input.value]));
    const changes = edited.map((input) => [input.dataset.key, input.value === '' ? NaN : Number(input.value)]);
    const loadOf = async (bus, id) => {
      const {surroundings} = await get(`/drives/${encodeURIComponent(bus)}/${id}`);
      const load = {...surroundings.load, ...Object.fromEntries(changes)};
      return {load: Object.fromEntries(Object.entries(load).filter(([key]) => isThere(key, load)))};
    };
    if (await direct(loadOf, t('load_is'))) settled(wanted);
  };
  const rows = kLoad.map(([, word, unit], n) => el('div', {class: 'pair'}, el('label', {for: inputs[n].id, text: t(word)}), inputs[n], el('span', {class: 'dim', text: unit})));
  return [says, el('div', {class: 'pairs'}, ...rows), el('div', {class: 'row'}, button(t('set_load'), set), button(t('as_now'), restore))];
}
