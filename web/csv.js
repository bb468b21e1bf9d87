// Writes samples as a file in the format of lk-emu run --csv: time_s,1.speed_dps,…

import {buses} from './store.js';

function textOf(traces, from_s, to_s) {
  const several = buses().length > 1;
  const columns = traces.map(({bus, id, signal, capture, column}) =>
    ({capture, n: column, name: `${several ? `${bus}.` : ''}${id}.${signal}`}));
  const lines = [['time_s', ...columns.map((column) => column.name)].join(',')];
  // Buses are sampled at different instants: each row has the latest sample of each.
  const base = traces[0].capture.samples;
  const last = base.find(to_s + 1e-9);
  for (let place = base.find(from_s); place < last; ++place) {
    const time_s = base.times[place];
    const row = columns.map(({capture, n}) => {
      const value = capture.samples === base ? base.values[n][place] : capture.samples.at(n, time_s);
      return Number.isFinite(value) ? value : '';
    });
    lines.push(`${time_s},${row.join(',')}`);
  }
  return lines;
}

/// Saves the file; returns the number of samples.
export function saveCsv(traces, from_s, to_s) {
  if (!traces.length) return 0;
  const lines = textOf(traces, from_s, to_s);
  if (lines.length === 1) return 0;
  const address = URL.createObjectURL(new Blob([lines.join('\n'), '\n'], {type: 'text/csv'}));
  const link = document.createElement('a');
  link.href = address;
  link.download = `lk-emu-${Math.max(0, from_s).toFixed(3)}s.csv`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
  return lines.length - 1;
}
