// The bench: all user actions on drives except sending frames.

import {byId, el} from './dom.js';
import {driveKey, on, store} from './store.js';
import {chooser, choose, chosenDrives} from './choice.js';
import {clockPanel} from './clock_panel.js';
import {evidencePanel, faultPanel} from './faults.js';
import {jogPanel} from './jog_panel.js';
import {scenarioPanel} from './scenario_panel.js';
import {shaftPanel, showShaft} from './shaft_panel.js';
import {supplyPanel, loadPanel} from './surroundings.js';
import {wantLive} from './live.js';
import {t} from './words.js';

let built = false;
let visible = false;
let fieldsets = [];

/// A panel; its controls are disabled while the page is read-only.
function panel(title, content, wide = false) {
  const set = el('fieldset', {}, ...content);
  fieldsets.push(set);
  return el('section', {class: wide ? 'panel wide' : 'panel', 'aria-label': title}, el('h2', {text: title}), set);
}

function build() {
  fieldsets = [];
  const hint = el('p', {id: 'bench-hint', class: 'panel'}, t('page_read_only'));
  byId('view-bench').replaceChildren(hint, chooser(), el('div', {class: 'bench'},
    panel(t('shaft'), shaftPanel()),
    panel(t('jog'), jogPanel()),
    panel(t('supply_and_ambient'), supplyPanel()),
    panel(t('load'), loadPanel()),
    panel(t('clock_title'), clockPanel()),
    panel(t('inject_fault'), faultPanel()),
    panel(t('scenario'), scenarioPanel(), true),
    panel(t('evidence'), evidencePanel(), true)));
  built = true;
  showShaft(visible);
}

export function show(yes) {
  visible = yes;
  wantLive(yes);
  showShaft(yes && built);
}

export function visit(query) {
  choose((query.get('drive') ?? '').split(','));
}

export function state() {
  const [first, ...others] = chosenDrives();
  return first === store.drives[0] && !others.length ? {} : {drive: chosenDrives().map(({bus, id}) => driveKey(bus, id))};
}

on('program', build);
on('change', () => {
  if (!built) return;
  byId('bench-hint').hidden = store.mayWrite;
  for (const set of fieldsets) set.disabled = !store.mayWrite || !store.connected;
});
