// Tells when the hosts of a bus stop sending, and when they send again.

import {el, note, setText} from './dom.js';
import {clockText, figures} from './format.js';
import {buses, on} from './store.js';
import {t} from './words.js';

const kSilent_ms = 2000;      // of real time (assumed: hosts send more often)
const kSilent_s = 0.5;        // and of simulated time, which may stand still

export function hostWatch() {
  const says = el('span', {class: 'faults', id: 'host-silent', role: 'status'});
  const last = new Map();  // by bus: number of frames from hosts, and when it was seen first
  on('change', () => {
    const silent = [];
    const at_ms = performance.now();
    for (const {bus, time_s, counters: {frames}} of buses()) {
      const name = buses().length > 1 ? bus : '';
      const before = last.get(bus);
      const isSilent = before?.frames && at_ms - before.at_ms > kSilent_ms && time_s - before.time_s > kSilent_s;
      if (frames !== before?.frames) {
        last.set(bus, {frames, time_s, at_ms});
        if (isSilent) note(t('host_again', {bus: name, s: figures((at_ms - before.at_ms) / 1000, 2)}).trim());
      } else if (isSilent) {
        silent.push(t('host_silent', {bus: name, time: clockText(before.time_s)}).trim());
      }
    }
    setText(says, silent.join(' '));
  }, says);
  return says;
}
