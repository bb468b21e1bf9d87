// Buttons of drives, grouped by bus.

import {el} from './dom.js';
import {buses, store} from './store.js';

const kLongest = 16;  // characters of a bus name

/// Returns the end of a name, "…-if00-port0" or "vcan0", unless that is the end of another one, too.
function shortName(bus) {
  const last = bus.split('/').at(-1);
  const short = last.length > kLongest ? `…${last.slice(1 - kLongest)}` : last;
  return buses().some((one) => one.bus !== bus && one.bus.endsWith(short.replace('…', ''))) ? bus : short;
}

/// Returns a group for each bus; `button(drive)` makes a button.
export function byBus(button) {
  return buses().map(({bus}) => el('span', {class: 'of-bus', role: 'group', 'aria-label': bus},
    buses().length > 1 ? el('span', {class: 'dim', title: bus, text: shortName(bus)}) : null,
    ...store.drives.filter((drive) => drive.bus === bus).map(button)));
}
