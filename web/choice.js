// The drives that the bench acts on.

import {el, note} from './dom.js';
import {post} from './api.js';
import {driveGroups, showPressed} from './drive_list.js';
import {buses, driveKey, driveOf, store} from './store.js';
import {t} from './words.js';

const chosen = new Set();  // drive keys
const listeners = new Set();
let group = null;

export const onChoice = (listener) => listeners.add(listener);
export const chosenDrives = () => store.drives.filter((drive) => chosen.has(driveKey(drive.bus, drive.id)));

function build() {
  const button = (text, onclick) => el('button', {type: 'button', onclick}, text);
  const toggle = (bus, id) => {
    if (!chosen.delete(driveKey(bus, id))) chosen.add(driveKey(bus, id));
    tell();
  };
  group.replaceChildren(el('span', {class: 'dim', text: t('for_drives')}), ...driveGroups(toggle),
    button(t('all'), () => {
      for (const {bus, id} of store.drives) chosen.add(driveKey(bus, id));
      tell();
    }), button(t('none'), () => {
      chosen.clear();
      tell();
    }));
  showChosen();
}

const showChosen = () => showPressed(group, (key) => chosen.has(key));

function tell() {
  showChosen();
  listeners.forEach((listener) => listener());
}

export function chooser() {
  listeners.clear();
  group = el('div', {class: 'row picks', role: 'group', 'aria-label': t('drives_meant'), 'data-needs-program': true});
  const there = new Set(store.drives.map(({bus, id}) => driveKey(bus, id)));
  for (const key of chosen) if (!there.has(key)) chosen.delete(key);
  if (!chosen.size && store.drives.length) chosen.add(driveKey(store.drives[0].bus, store.drives[0].id));
  build();
  return group;
}

/// Chooses the drives of these keys that exist; without one, the choice stays.
export function choose(keys) {
  const there = keys.filter(driveOf);
  if (!there.length) return;
  chosen.clear();
  for (const key of there) chosen.add(key);
  if (group) tell();
}

/// A list of IDs; the API also takes ranges ("1-3,7").
const idList = (drives) => drives.map((drive) => drive.id).join(',');

/// Posts `what` for the chosen drives: once per bus, or per drive if it is a function of (bus, id). Returns success.
async function tellChosen(place, what, done) {
  const drives = chosenDrives();
  if (!drives.length) {
    note(t('choose_first'), true);
    return false;
  }
  return attempt(async () => {
    if (typeof what === 'function') {
      for (const {bus, id} of drives) await post(place, {bus, id, ...await what(bus, id)});
      return;
    }
    for (const {bus} of buses()) {
      const mine = drives.filter((drive) => drive.bus === bus);
      if (mine.length) await post(place, {bus, ids: idList(mine), ...what});
    }
  }, done);
}

/// Sends a directive (docs/reference/events.md).
export const direct = (what, done) => tellChosen('/directives', what, done);
/// Sends a frame as a host does, with the keys of a scenario's [[send]].
export const command = (what, done) => tellChosen('/frames', what, done);

/// Runs the action and shows its result or error.
export async function attempt(action, done) {
  try {
    const result = await action();
    if (done) note(typeof done === 'function' ? done(result) : done);
    return true;
  } catch (problem) {
    note(problem.message, true);
    return false;
  }
}
