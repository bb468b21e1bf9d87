// Header of all views: clock, bus load, connection.

import {byId, el, setText} from './dom.js';
import {clockText, figures, fixed} from './format.js';
import {buses, on, store} from './store.js';
import {t} from './words.js';

const loads = new Map();

function buildLoads() {
  loads.clear();
  for (const {bus, bitrate} of buses()) {
    const meter = el('meter', {min: 0, max: 1, low: 0.6, high: 0.85, optimum: 0, 'aria-label': t('load_of', {bus})});
    const value = el('span', {class: 'value', text: '–'});
    const root = el('div', {class: 'load', title: bitrate ? t('bus_rate', {bus, rate: bitrate / 1000}) : t('bus_no_time', {bus})},
      el('span', {class: 'name', text: bus}), meter, value);
    loads.set(bus, {root, meter, value});
  }
  byId('loads').replaceChildren(...[...loads.values()].map((load) => load.root));
}

function showLoads() {
  for (const {bus, up} of buses()) {
    const load = loads.get(bus);
    if (!load) continue;
    const share = store.rates.get(bus);
    load.meter.value = Math.min(1, share ?? 0);
    setText(load.value, !up ? t('down') : share === null || share === undefined ? '–' : `${fixed(share * 100, 0)} %`);
    load.root.classList.toggle('down', !up);
  }
}

function showClock() {
  const {clock} = store.status;
  setText(byId('sim-time'), clockText(clock.time_s));
  setText(byId('clock-mode'), t(clock.mode));
  const ratio = store.rates.get('clock');
  setText(byId('clock-ratio'), ratio === null || ratio === undefined ? '–' : `${fixed(ratio, 2)} ×`);
  byId('slipped').hidden = clock.slipped_s === 0;
  setText(byId('slipped').querySelector('dd'), `${figures(clock.slipped_s, 3)} s`);
}

function showConnection() {
  for (const control of document.querySelectorAll('[data-needs-program] :is(button, input, select)')) control.disabled = !store.connected;
  const banner = byId('lost');
  if (store.connected) {
    banner.hidden = true;
    return;
  }
  if (banner.hidden) banner.textContent = t('lost');
  banner.hidden = false;
}

function showAccess() {
  const chip = byId('access');
  chip.hidden = store.status === null || store.mayWrite;
  setText(chip, t('read_only'));
  chip.title = t('may_act_with');
}

on('program', buildLoads);
on('change', () => {
  showConnection();
  showAccess();
  if (!store.status) return;
  showLoads();
  showClock();
});

const kTheme = 'lk-emu-theme';
function applyTheme(theme) {
  document.documentElement.dataset.theme = theme;
  document.dispatchEvent(new Event('theme'));
}
const bright = matchMedia('(prefers-color-scheme: light)');
const preferred = () => localStorage.getItem(kTheme) ?? (bright.matches ? 'light' : 'dark');
applyTheme(preferred());
bright.addEventListener('change', () => applyTheme(preferred()));
byId('theme').addEventListener('click', () => {
  localStorage.setItem(kTheme, document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark');
  applyTheme(preferred());
});
