// Recordings of the scope: streams of the chosen signals, and the traces drawn from them.

import {Capture, possibleRate_Hz} from './capture.js';
import {unitOf} from './format.js';
import {buses, driveKey, driveName, driveOf, store} from './store.js';

const kWatchAll = 50_000;  // values per second: below this all drives are recorded, so that each has a history

export const traceKey = ({bus, id, signal}) => `${driveKey(bus, id)} ${signal}`;

function colourOf(index, count) {
  const hue = count <= 8 ? [176, 38, 215, 340, 95, 275, 8, 60][index % 8] : (index * 137.5) % 360;
  const light = document.documentElement.dataset.theme === 'light';
  return `hsl(${hue} ${light ? 75 : 70}% ${light ? 36 : 64}%)`;
}

/// References are dashed, true values dotted, so that they can overlap the measured lines.
function dashOf(signal) {
  if (signal.includes('_ref_')) return [9, 5];
  return signal.startsWith('true_') ? [2, 3] : undefined;
}

/// Returns the captures for `chosen` and for the signals that a trigger needs. Keeps captures that suffice; new ones
/// take over existing samples of the same signals.
export function watch(captures, chosen, needs) {
  const other = needs && driveOf(needs.drive);
  const signals = [...new Set([...chosen.signals, ...(other ? [needs.signal] : [])])];
  const all = store.drives.length * signals.length * chosen.rate_Hz <= kWatchAll;
  const picked = chosen.signals.length ? chosen.drives : [];
  const drives = all ? store.drives : [...picked, ...(other && !picked.some((one) => one.bus === other.bus && one.id === other.id) ? [other] : [])];
  const wanted = signals.length ? buses().map(({bus}) => ({bus, ids: drives.filter((one) => one.bus === bus).map((one) => one.id)}))
    .filter(({ids}) => ids.length) : [];
  const rate_Hz = possibleRate_Hz(chosen.rate_Hz, drives.length * signals.length);
  const before = new Map(captures.map((capture) => [capture.bus, capture]));
  if (wanted.every(({bus, ids}) => before.get(bus)?.serves(ids, signals, rate_Hz))) return captures;
  captures.forEach((capture) => capture.close());
  return wanted.map(({bus, ids}) => new Capture(bus, ids, signals, rate_Hz, before.get(bus)));
}

export function tracesOf(captures, {drives, signals, hidden}) {
  const many = drives.length > 1;
  const total = drives.length * signals.length;
  return drives.flatMap(({bus, id}, drive) => signals.map((signal, n) => {
    const capture = captures.find((one) => one.bus === bus);
    const index = many && signals.length > 1 && total > 8 ? drive : drive * signals.length + n;
    const trace = {bus, id, signal, capture, column: capture.column(id, signal), unit: unitOf(signal),
      label: `${driveName(bus, id)} ${signal}`, index, of: many && total > 8 ? drives.length : total, dash: dashOf(signal)};
    trace.shown = !hidden.has(traceKey(trace));
    return trace;
  }));
}

export function recolour(traces) {
  for (const trace of traces) trace.colour = colourOf(trace.index, trace.of);
}

/// Returns [times, values…] of traces at the times of the first capture, also for other buses.
export function dataOf(some, {from_s, to_s}, bins) {
  const byCapture = new Map();
  for (const trace of some) {
    if (!byCapture.has(trace.capture)) byCapture.set(trace.capture, []);
    byCapture.get(trace.capture).push(trace);
  }
  const tables = [...byCapture].map(([capture, list]) =>
    capture.samples.view(from_s, to_s, bins, list.map((trace) => trace.column)));
  const joined = tables.length === 1 ? tables[0] : uPlot.join(tables.map((one) => one.map((column) => Array.from(column))));
  const order = [...byCapture.values()].flat();
  return [joined[0], ...some.map((trace) => joined[1 + order.indexOf(trace)])];
}
