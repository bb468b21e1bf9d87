// Keeps what the scope is to show: one stream for each bus, samples in fixed memory.

import {stream} from './api.js';
import {Samples} from './samples.js';
import {clockFactor} from './store.js';

const kMostValues = 190_000;  // a second, of simulated time and of the wall; the program allows 200,000
const kMessages_Hz = 60;

/// What is possible of the wanted rate.
export const possibleRate_Hz = (wanted_Hz, columns) => Math.min(wanted_Hz, kMostValues / columns / Math.max(1, clockFactor()));

/// The samples of `ids` of one bus, `signals` of each.
export class Capture {
  constructor(bus, ids, signals, wanted_Hz) {
    this.bus = bus;
    this.ids = ids;
    this.signals = signals;
    const columns = ids.length * signals.length;
    const factor = clockFactor() || 1;
    this.rate_Hz = possibleRate_Hz(wanted_Hz, columns);
    this.samples = new Samples(columns);
    this.lost = 0;
    const together = Math.max(1, Math.min(1000, Math.round(this.rate_Hz * factor / kMessages_Hz)));
    const query = `bus=${encodeURIComponent(bus)}&ids=${ids}&signals=${signals}&rate_Hz=${this.rate_Hz}` +
      (together > 1 ? `&samples_per_message=${together}` : '');
    this.row = new Array(columns);
    this.stream = stream(`/telemetry?${query}`, {onMessage: (message) => this.take(message)});
  }

  take(message) {
    for (const sample of Array.isArray(message) ? message : [message]) {
      if (!sample.rows) continue;
      if (sample.lost) this.lost = sample.lost;
      let column = 0;
      for (const row of sample.rows) {
        for (let n = 1; n < row.length; ++n) this.row[column++] = row[n];
      }
      // Another program, or the same one anew: its time begins again.
      if (sample.time_s < this.samples.last_s - 1) this.samples = new Samples(this.samples.columns);
      this.samples.push(sample.time_s, this.row);
    }
  }

  column(id, signal) {
    return this.ids.indexOf(id) * this.signals.length + this.signals.indexOf(signal);
  }

  close() {
    this.stream.close();
  }
}
