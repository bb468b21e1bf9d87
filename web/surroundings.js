// Supply, ambient temperature and load of the chosen drives.

import {el, labelled} from './dom.js';
import {chosenDrives, direct, onChoice} from './choice.js';

const plain = (value) => String(Number(value.toPrecision(6)));  // as inputs want it
const number = (attributes) => el('input', {type: 'number', step: 'any', ...attributes});
const button = (text, onclick, attributes = {}) => el('button', {type: 'button', onclick, ...attributes}, text);

export function supplyPanel() {
  const supply = number({min: 0, max: 100, value: 24, 'aria-label': 'supply, V'});
  const ramp = number({min: 0, value: 0, 'aria-label': 'within, s'});
  const sag = number({min: 0, max: 100, value: 12, 'aria-label': 'sag to, V'});
  const sagFor = number({min: 0, value: 0.1, 'aria-label': 'for, s'});
  const off = number({min: 0, value: 0.5, 'aria-label': 'off for, s'});
  const ambient = number({min: -40, max: 125, value: 25, 'aria-label': 'ambient, °C'});
  const configured = () => {
    const drive = chosenDrives()[0];
    if (!drive?.built) return;
    supply.value = plain(drive.built.supply_V);
    ambient.value = plain(drive.built.ambient_C);
  };
  onChoice(configured);
  configured();
  return [
    el('div', {class: 'row', role: 'group', 'aria-label': 'power'}, button('Power on', () => direct({power: 'on'}, 'power is on')),
      button('Power off', () => direct({power: 'off'}, 'power is off'), {class: 'danger'}),
      button('Cycle', () => direct({power: 'cycle', off_s: Number(off.value)}, `off for ${off.value} s, then on`)), labelled('off for', off), ' s'),
    el('div', {class: 'row'}, labelled('supply', supply), 'V', labelled('within', ramp), 's',
      button('Set', () => direct({supply_V: Number(supply.value), ramp_s: Number(ramp.value)}, `supply goes to ${supply.value} V`), {'aria-label': 'set the supply'})),
    el('div', {class: 'row'}, labelled('sag to', sag), 'V', labelled('for', sagFor), 's',
      button('Sag', () => direct({sag_to_V: Number(sag.value), sag_s: Number(sagFor.value)}, `sag to ${sag.value} V`))),
    el('div', {class: 'row'}, labelled('ambient', ambient), '°C',
      button('Set', () => direct({ambient_C: Number(ambient.value)}, `it is ${ambient.value} °C there`), {'aria-label': 'set the ambient temperature'})),
  ];
}

const kLoad = [
  ['J_g_cm2', 'inertia', 'g·cm²', 'at the output'],
  ['tau_Nm', 'torque', 'Nm', 'constant, positive pushes clockwise'],
  ['tau_gravity_Nm', 'gravity', 'Nm', 'm·g·l of an arm: the torque is −gravity·sin(angle)'],
  ['theta_min_deg', 'stop from', '°', 'end stop, output; empty: none'],
  ['theta_max_deg', 'to', '°', 'end stop, output; empty: none'],
];
const kNoStop = 1e6;

export function loadPanel() {
  const inputs = kLoad.map(([key, , , title]) => number({title, 'data-key': key}));
  const configured = () => {
    const load = chosenDrives()[0]?.built?.load ?? {};
    kLoad.forEach(([key], n) => {
      inputs[n].value = Math.abs(load[key] ?? NaN) < kNoStop ? plain(load[key]) : '';
    });
  };
  onChoice(configured);
  configured();
  const set = () => {
    const load = {};
    kLoad.forEach(([key], n) => {
      if (inputs[n].value !== '') load[key] = Number(inputs[n].value);
    });
    return direct({load}, 'the load is another one');
  };
  const rows = kLoad.map(([, name, unit], n) => el('div', {class: 'pair'}, el('label', {}, name, inputs[n]), el('span', {class: 'dim', text: unit})));
  return [el('div', {class: 'pairs'}, ...rows), el('div', {class: 'row'}, button('Set load', set), button('As configured', configured))];
}
