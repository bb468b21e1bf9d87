// Controls of the scope: a toolbar, and a drawer with drives, signals, rate, trigger, layouts and the table of values.

import {el, labelled, setText} from './dom.js';
import {driveGroups, showPressed} from './drive_list.js';
import {figures} from './format.js';
import {driveKey, store} from './store.js';
import {about as aboutOf, t} from './words.js';

const kSets = {
  position: ['angle_ref_deg', 'angle_deg'],
  speed: ['speed_ref_dps', 'speed_dps', 'true_rotor_dps'],
  current: ['iq_ref_A', 'iq_A', 'true_iq_A'],
  phases: ['ia_A', 'ib_A', 'ic_A'],
  duties: ['duty_a', 'duty_b', 'duty_c'],
  temperatures: ['temperature_C', 'driver_temperature_C', 'winding_C', 'housing_C', 'stage_C'],
  supply: ['voltage_V', 'true_voltage_V', 'bus_current_A'],
};
const kRates_Hz = [100, 500, 1000, 2000, 5000, 10000, 20000];
const kWidths_s = [0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 30, 60, 300];

export class ScopeControls {
  constructor(chosen, does) {
    this.chosen = chosen;
    this.does = does;
    this.pause = el('button', {type: 'button', class: 'main', 'aria-pressed': 'false', onclick: does.pause}, t('pause'));
    this.width = el('select', {'aria-label': t('width_label'), onchange: () => does.setWidth(Number(this.width.value))},
      ...kWidths_s.map((s) => el('option', {value: s, text: `${figures(s)} s`})));
    this.width.value = 5;
    this.rate = el('select', {'aria-label': t('rate_label'), onchange: () => { chosen.rate_Hz = Number(this.rate.value); does.restart(); }},
      ...kRates_Hz.map((rate) => el('option', {value: rate, text: `${rate / 1000} kHz`})));
    this.rate.value = chosen.rate_Hz;
    this.spectra = el('button', {type: 'button', title: t('spectra_about'), 'aria-pressed': 'false', onclick: does.spectra}, 'FFT');
    this.frames = el('span', {class: 'dim', id: 'scope-info'});
    this.drives = el('div', {class: 'row picks', role: 'group', 'aria-label': t('drives')});
    this.sets = el('div', {class: 'row picks', role: 'group', 'aria-label': t('signal_sets'), 'data-needs-program': true});
    this.signals = el('div', {class: 'signal-list', role: 'group', 'aria-label': t('signals'), 'data-needs-program': true});
    const button = (text, title, onclick) => el('button', {type: 'button', title, onclick}, text);
    this.toggle = el('button', {type: 'button', class: 'toggle', 'aria-controls': 'scope-drawer', onclick: () => this.open(this.drawer.hidden)}, t('scope_controls'));
    this.folded = el('div', {class: 'folded'}, el('details', {}, el('summary', {text: t('all_signals')}), this.signals),
      this.layouts = el('details', {}, el('summary', {text: t('layouts')})));
    this.drawer = el('div', {class: 'panel drawer', id: 'scope-drawer', role: 'group', 'aria-label': t('scope_controls')}, this.drives, this.sets,
      el('div', {class: 'row'}, el('span', {'data-needs-program': true}, labelled(t('rate'), this.rate)), button('CSV', t('csv_about'), does.exportCsv), this.frames), this.folded);
    this.root = el('div', {class: 'scope-controls'},
      el('div', {class: 'row tools'}, this.pause,
        labelled(t('width'), this.width), button('+', t('zoom_in'), () => does.zoom(0.5)), button('−', t('zoom_out'), () => does.zoom(2)),
        button('←', t('earlier'), () => does.pan(-0.2)), button('→', t('later'), () => does.pan(0.2)),
        ...['A', 'B'].map((name) => button(name, t('cursor_label', {name}), () => does.putCursor(name))),
        button(t('no_cursors'), t('no_cursors_about'), does.clearCursors), this.spectra, this.toggle),
      this.drawer);
    const wide = matchMedia('(min-width: 1000px)');  // as in views.css
    wide.addEventListener('change', () => this.open(wide.matches));
    this.open(wide.matches);
  }

  open(yes) {
    this.drawer.hidden = !yes;
    this.toggle.setAttribute('aria-expanded', yes);
  }

  /// Adds the controls of trigger and layouts, and the table of values.
  add({trigger, layouts, table}) {
    this.folded.before(trigger);
    this.layouts.append(layouts);
    this.drawer.append(table);
  }

  build() {
    this.before = null;
    this.all = el('button', {type: 'button', title: t('all_drives_about'), onclick: () => this.toggleAll()}, t('all_drives'));
    this.drives.replaceChildren(el('span', {class: 'dim', text: t('drives')}), ...driveGroups((bus, id) => this.toggleDrive(bus, id)), this.all);
    this.setButtons = Object.entries(kSets).map(([name, signals]) => ({signals, button: el('button', {type: 'button', title: signals.join(', '),
      onclick: () => this.toggleSet(signals)}, t(`group_${name}`))}));
    this.sets.replaceChildren(el('span', {class: 'dim', text: t('signals')}), ...this.setButtons.map((one) => one.button));
    this.boxes = store.signals.map(({name, about}) => ({name, box: el('input', {type: 'checkbox', onchange: () => this.toggleSignal(name)}), about}));
    this.signals.replaceChildren(...this.boxes.map(({name, box, about}) => el('label', {title: aboutOf('signals', name, about)}, box, ` ${name}`)));
  }

  pick(drives) {
    this.chosen.drives = drives;
    this.does.restart();
  }

  get showsAll() {
    return this.chosen.drives.length === store.drives.length;
  }

  /// Selects all drives; the next time restores the previous choice.
  toggleAll() {
    if (this.showsAll) {
      this.pick(this.before ?? this.chosen.drives.slice(0, 1));
    } else {
      this.before = this.chosen.drives;
      this.pick(store.drives.map(({bus, id}) => ({bus, id})));
    }
  }

  toggleDrive(bus, id) {
    const others = this.chosen.drives.filter((one) => one.bus !== bus || one.id !== id);
    this.pick(others.length === this.chosen.drives.length ? [...others, {bus, id}] : others);
  }

  toggleSet(signals) {
    const has = signals.every((name) => this.chosen.signals.includes(name));
    this.chosen.signals = has ? this.chosen.signals.filter((name) => !signals.includes(name))
      : [...new Set([...this.chosen.signals, ...signals])];
    this.does.restart();
  }

  toggleSignal(name) {
    const has = this.chosen.signals.includes(name);
    this.chosen.signals = has ? this.chosen.signals.filter((one) => one !== name) : [...this.chosen.signals, name];
    this.does.restart();
  }

  showChosen({drives, signals}) {
    showPressed(this.drives, (key) => drives.some(({bus, id}) => driveKey(bus, id) === key));
    this.all.setAttribute('aria-pressed', this.showsAll);
    for (const set of this.setButtons) set.button.setAttribute('aria-pressed', set.signals.every((name) => signals.includes(name)));
    for (const {name, box} of this.boxes) box.checked = signals.includes(name);
  }

  showHeld(held) {
    setText(this.pause, held ? t('resume') : t('pause'));
    this.pause.setAttribute('aria-pressed', held);
  }

  showSpectra(yes) {
    this.spectra.setAttribute('aria-pressed', yes);
  }

  showRate(rate_Hz) {
    this.rate.value = kRates_Hz.reduce((best, rate) => (Math.abs(rate - rate_Hz) < Math.abs(best - rate_Hz) ? rate : best));
  }

  showWidth(width_s) {
    const near = kWidths_s.reduce((best, s) => (Math.abs(Math.log(s / width_s)) < Math.abs(Math.log(best / width_s)) ? s : best));
    this.width.value = near;
  }

  showFrames(frames, captures) {
    const lost = captures.reduce((sum, capture) => sum + capture.lost, 0);
    const kept_s = Math.max(0, ...captures.map(({samples}) => samples.last_s - samples.first_s || 0));
    const rate_Hz = Math.min(...captures.map((capture) => capture.rate_Hz));
    const reduced = rate_Hz < this.chosen.rate_Hz ? t('scope_reduced', {rate: figures(rate_Hz, 4)}) : '';
    const refused = captures.filter((capture) => capture.refused).map((capture) => capture.bus).join(', ');
    setText(this.frames, t('scope_info', {frames, kept: figures(kept_s, 3)}) + (lost ? t('scope_lost', {n: lost}) : '') + reduced +
      (refused ? t('scope_refused', {bus: refused}) : ''));
  }
}
