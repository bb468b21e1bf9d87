// Records the samples of the scope: one stream for each bus, in fixed memory.

import {stream} from './api.js';
import {Samples} from './samples.js';
import {clockFactor} from './store.js';

// Samples per second of simulated time and of real time, on all buses. The program allows 200,000 per stream and
// 400,000 in total; the dials of this page (live.js) may use the other half.
const kMaxValues = 190_000;
const kSlowest_Hz = 0.1;
const kDigits = 9;
const kMessages_Hz = 30;
const kPatience_ms = 3000;
const kInstant_s = 1e-6;  // resolution of the clock

/// Returns simulated seconds per real second, at least 1, because a slow or stopped clock needs no lower rate.
export const pace = () => Math.max(1, clockFactor());

/// Returns the possible rate for this number of columns on all buses together.
export const possibleRate_Hz = (wanted_Hz, columns) => Math.max(kSlowest_Hz, Math.min(wanted_Hz, kMaxValues / columns / pace()));

/// Records `signals` of drives `ids` of one bus. Takes over the samples of `before`, the previous capture of this bus.
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
    this.lostBefore = this.lost;  // the program counts from 0 for each stream
    this.row = new Array(columns);
    this.waitsFrom_ms = null;  // start of waiting for the stream
    const together = Math.max(1, Math.min(1000, Math.round(rate_Hz * this.pace / kMessages_Hz)));
    const query = `bus=${encodeURIComponent(bus)}&ids=${ids}&signals=${signals}&rate_Hz=${rate_Hz}&digits=${kDigits}` +
      (together > 1 ? `&samples_per_message=${together}` : '');
    this.path = `/telemetry?${query}`;
    this.stream = null;  // null: not recording
    this.isAfterGap = false;
  }

  /// Starts or stops to record; repeated calls do no harm.
  record(yes) {
    if (yes === (this.stream !== null)) return;
    this.waitsFrom_ms = yes ? performance.now() : null;
    this.isAfterGap = this.samples.length > 0;
    this.stream?.close();
    this.stream = yes ? stream(this.path, {
      onMessage: (message) => this.take(message),
      onOpen: () => {
        this.waitsFrom_ms = null;
        this.lostBefore = this.lost;
      },
      onClose: () => { this.waitsFrom_ms ??= performance.now(); }}) : null;
  }

  take(message) {
    for (const sample of Array.isArray(message) ? message : [message]) {
      if (!sample.rows) continue;
      if (sample.lost) this.lost = this.lostBefore + sample.lost;
      // Rows have the program's order, not that of `ids`.
      for (const row of sample.rows) {
        const first = this.ids.indexOf(row[0]) * this.signals.length;
        for (let n = 1; n < row.length; ++n) this.row[first + n - 1] = row[n];
      }
      // Time went back: the program was restarted or replaced.
      if (sample.time_s < this.samples.last_s - 1) this.samples = new Samples(this.samples.columns);
      if (this.isAfterGap) this.samples.push(sample.time_s - kInstant_s, []);
      this.isAfterGap = false;
      this.samples.push(sample.time_s, this.row);
    }
  }

  /// Returns the column, or -1.
  column(id, signal) {
    const drive = this.ids.indexOf(id);
    const place = this.signals.indexOf(signal);
    return drive < 0 || place < 0 ? -1 : drive * this.signals.length + place;
  }

  /// Returns whether it records all of these at this rate.
  serves(ids, signals, rate_Hz) {
    return this.rate_Hz === rate_Hz && this.pace === pace() &&
      ids.every((id) => this.ids.includes(id)) && signals.every((signal) => this.signals.includes(signal));
  }

  /// Whether its stream has been closed long enough to tell the user.
  get refused() {
    return this.waitsFrom_ms !== null && performance.now() - this.waitsFrom_ms > kPatience_ms;
  }

  close() {
    this.record(false);
  }
}
