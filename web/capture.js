// Keeps what the scope is to show: one stream for each bus, samples in fixed memory.

import {stream} from './api.js';
import {Samples} from './samples.js';
import {clockFactor} from './store.js';

// A second of simulated time and of the wall, of all buses; the program allows 200,000 a stream and 400,000 in all, of which
// the dials of this page (live.js) may have as many.
const kMostValues = 190_000;
const kSlowest_Hz = 0.1;
const kMessages_Hz = 60;
const kPatience_ms = 3000;

/// Simulated seconds in one of the wall, where there are more of them: a clock that is slow or stands asks for nothing else.
export const pace = () => Math.max(1, clockFactor());

/// What is possible of the wanted rate with so many columns on all buses together.
export const possibleRate_Hz = (wanted_Hz, columns) => Math.max(kSlowest_Hz, Math.min(wanted_Hz, kMostValues / columns / pace()));

/// The samples of `ids` of one bus, `signals` of each. What `before`, another one of this bus, has of them is taken over.
export class Capture {
  constructor(bus, ids, signals, rate_Hz, before) {
    this.bus = bus;
    this.ids = ids;
    this.signals = signals;
    this.rate_Hz = rate_Hz;
    this.pace = pace();
    const columns = ids.length * signals.length;
    this.samples = new Samples(columns);
    if (before) this.samples.adopt(before.samples, ids.flatMap((id) => signals.map((signal) => before.column(id, signal))));
    this.lost = before?.lost ?? 0;
    this.lostBefore = this.lost;  // the program counts from the beginning of each stream
    this.row = new Array(columns);
    this.waitsFrom_ms = performance.now();  // for its stream to open; null: it has
    const together = Math.max(1, Math.min(1000, Math.round(rate_Hz * this.pace / kMessages_Hz)));
    const query = `bus=${encodeURIComponent(bus)}&ids=${ids}&signals=${signals}&rate_Hz=${rate_Hz}` +
      (together > 1 ? `&samples_per_message=${together}` : '');
    this.stream = stream(`/telemetry?${query}`, {
      onMessage: (message) => this.take(message),
      onOpen: () => {
        this.waitsFrom_ms = null;
        this.lostBefore = this.lost;
      },
      onClose: () => { this.waitsFrom_ms ??= performance.now(); }});
  }

  take(message) {
    for (const sample of Array.isArray(message) ? message : [message]) {
      if (!sample.rows) continue;
      if (sample.lost) this.lost = this.lostBefore + sample.lost;
      // Rows come in the order of the program, not in that of `ids`.
      for (const row of sample.rows) {
        const first = this.ids.indexOf(row[0]) * this.signals.length;
        for (let n = 1; n < row.length; ++n) this.row[first + n - 1] = row[n];
      }
      // Another program, or the same one anew: its time begins again.
      if (sample.time_s < this.samples.last_s - 1) this.samples = new Samples(this.samples.columns);
      this.samples.push(sample.time_s, this.row);
    }
  }

  /// -1: it has none.
  column(id, signal) {
    const drive = this.ids.indexOf(id);
    const place = this.signals.indexOf(signal);
    return drive < 0 || place < 0 ? -1 : drive * this.signals.length + place;
  }

  /// Whether it has all of these, at this rate.
  serves(ids, signals, rate_Hz) {
    return this.rate_Hz === rate_Hz && this.pace === pace() &&
      ids.every((id) => this.ids.includes(id)) && signals.every((signal) => this.signals.includes(signal));
  }

  /// Whether its stream has not opened for so long that somebody should know.
  get refused() {
    return this.waitsFrom_ms !== null && performance.now() - this.waitsFrom_ms > kPatience_ms;
  }

  close() {
    this.stream.close();
  }
}
