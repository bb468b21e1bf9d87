// The state of the scope in the address of the page: a layout, with the window and the cursors of a paused scope.

import {checked} from './scope_layouts.js';

const kTexts = {drive: 'drives', signals: 'signals', hidden: 'hidden'};
const kValues = ['rate_Hz', 'width_s', 'ranges', 'spectra', 'trigger'];
const kTimes = ['from_s', 'to_s', 'A', 'B'];

const isSame = (one, other) => JSON.stringify(one) === JSON.stringify(other);
const inMicroseconds = (time_s) => (time_s === null ? null : Number(time_s.toFixed(6)));

/// Returns what differs from `initial`, by key; `held` and `cursors` are those of ScopeWindow.
export function toAddress(layout, initial, held, cursors) {
  const state = {};
  for (const [key, part] of Object.entries(kTexts)) if (!isSame(layout[part], initial[part])) state[key] = layout[part].join(',');
  for (const key of kValues) if (!isSame(layout[key], initial[key])) state[key] = JSON.stringify(layout[key]);
  const times = held ? {...held, ...cursors} : {};
  for (const key of kTimes) state[key] = inMicroseconds(times[key] ?? null);
  return state;
}

/// Returns {layout, times}; what the address does not contain is that of `present`. Throws if it is invalid.
export function fromAddress(query, present) {
  const layout = {...present};
  for (const [key, part] of Object.entries(kTexts)) if (query.has(key)) layout[part] = query.get(key).split(',').filter(Boolean);
  for (const key of kValues) if (query.has(key)) layout[key] = JSON.parse(query.get(key));
  const times = Object.fromEntries(kTimes.map((key) => [key, query.has(key) ? Number(query.get(key)) : null]));
  return {layout: checked(layout, '#scope'), times};
}
