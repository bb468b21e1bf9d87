// Buttons of drives, grouped by bus.

import {el} from './dom.js';
import {buses, driveKey, driveName, store} from './store.js';
import {t} from './words.js';

const kLongest = 16;  // characters of a bus name

/// Returns the end of a name, "…-if00-port0" or "vcan0", unless that is the end of another one, too.
function shortName(bus) {
  const last = bus.split('/').at(-1);
  const short = last.length > kLongest ? `…${last.slice(1 - kLongest)}` : last;
  return buses().some((one) => one.bus !== bus && one.bus.endsWith(short.replace('…', ''))) ? bus : short;
}

function driveButton({bus, id}, onclick) {
  const label = t('drive_label', {name: driveName(bus, id)});
  return el('button', {type: 'button', 'data-drive-key': driveKey(bus, id), 'aria-label': label, title: label, onclick: () => onclick(bus, id)}, String(id));
}

/// Returns a group of buttons for each bus; a click calls `onclick` with bus and ID.
export function driveGroups(onclick) {
  return buses().map(({bus}) => el('span', {class: 'of-bus', role: 'group', 'aria-label': bus},
    buses().length > 1 ? el('span', {class: 'dim', title: bus, text: shortName(bus)}) : null,
    ...store.drives.filter((drive) => drive.bus === bus).map((drive) => driveButton(drive, onclick))));
}

/// Shows for each button in `root` whether `isPressed(key)`. The buttons stay, with focus and pending clicks.
export function showPressed(root, isPressed) {
  for (const button of root.querySelectorAll('[data-drive-key]')) button.setAttribute('aria-pressed', isPressed(button.dataset.driveKey));
}
