// Trigger of the scope: a level crossing, an error bit, or a command on the bus.

import {stream} from './api.js';
import {driveKey} from './store.js';

export const kModes = ['off', 'auto', 'normal', 'single'];
export const kKinds = ['level', 'error', 'command'];
export const kErrors = ['under_voltage', 'over_voltage', 'driver_temperature', 'motor_temperature', 'over_current', 'short_circuit', 'stall', 'lost_input'];

const kMaxAtOnce = 100_000;   // samples per look: takes a millisecond
const kMaxShots = 16;         // triggers found in one look
const kMaxCommands = 1000;    // kept until their plots are complete
const kPatience_s = 0.5;      // auto mode: after this time without a trigger, or two plot widths, the plot runs

export const defaults = () => ({mode: 'off', kind: 'level', drive: '', signal: 'speed_dps', edge: 'rising', level: 0, error: 'any', command: 'A4', before: 0.25});

/// Returns the first time after from_s at which `holds` becomes true: {at_s, next_s}; at_s is null if there is none.
/// With `level`, at_s is interpolated to the crossing; otherwise it is the time of the sample.
export function findChange(samples, column, from_s, holds, level = null) {
  const values = samples.values[column];
  const begin = samples.find(from_s);
  const end = Math.min(samples.end, begin + kMaxAtOnce);
  let before = begin > samples.begin ? begin - 1 : begin;
  for (let n = before + 1; n < end; ++n) {
    if (Number.isNaN(values[n])) continue;
    if (!Number.isNaN(values[before]) && holds(values[n]) && !holds(values[before])) {
      const [then, now] = [samples.times[before], samples.times[n]];
      const share = level === null ? 1 : (level - values[before]) / (values[n] - values[before]);
      return {at_s: then + (now - then) * share, next_s: now + 1e-9};
    }
    before = n;
  }
  return {at_s: null, next_s: end > begin ? samples.times[end - 1] + 1e-9 : from_s};
}

const maskOf = (error) => (error === 'any' ? 0xFFFF : 1 << kErrors.indexOf(error));

export class Trigger {
  constructor() {
    this.settings = defaults();
    this.commands = [];  // times of the commands seen
    this.stream = null;
    this.arm(0);
  }

  get on() {
    return this.settings.mode !== 'off';
  }
  /// The signal to sample for the trigger, {drive, signal}; null: none.
  get needs() {
    const {kind, drive, signal} = this.settings;
    if (!this.on || kind === 'command') return null;
    return {drive, signal: kind === 'error' ? 'errors' : signal};
  }

  /// Waits for triggers after now_s.
  arm(now_s) {
    this.from_s = this.armed_s = now_s;
    this.pending_s = null;  // trigger whose plot is not yet complete
    this.shot_s = null;     // last trigger with a complete plot
    this.done = false;      // single mode: has triggered
    this.commands = [];
  }

  /// Streams the frames of a bus while a command trigger is on.
  listen(bus) {
    this.stream?.close();
    this.stream = null;
    if (!this.on || this.settings.kind !== 'command' || !bus) return;
    this.stream = stream(`/frames?bus=${encodeURIComponent(bus)}`, {onMessage: ({frames}) => this.hear(bus, frames ?? [])});
  }

  hear(bus, frames) {
    const {command, drive} = this.settings;
    for (const frame of frames) {
      if (frame.from !== 'host' || frame.command !== command) continue;
      if (frame.id === 0 || driveKey(bus, frame.id) === drive) this.commands.push(frame.time_s);
    }
    if (this.commands.length > kMaxCommands) this.commands.splice(0, this.commands.length - kMaxCommands);
  }

  /// Returns {at_s, next_s} of the first trigger after from_s.
  find(capture, id) {
    const {kind, edge, level, error} = this.settings;
    if (kind === 'command') {
      const at_s = this.commands.find((time_s) => time_s >= this.from_s) ?? null;
      return {at_s, next_s: at_s === null ? this.from_s : at_s + 1e-9};
    }
    const column = capture?.column(id, this.needs.signal) ?? -1;
    if (column < 0) return {at_s: null, next_s: this.from_s};
    if (kind === 'error') {
      const mask = maskOf(error);
      return findChange(capture.samples, column, this.from_s, (value) => (value & mask) !== 0);
    }
    const holds = edge === 'rising' ? (value) => value >= level : (value) => value <= level;
    return findChange(capture.samples, column, this.from_s, holds, level);
  }

  /// Examines new samples; `capture` has the signal of drive `id`. Returns whether there is a new plot.
  look(capture, id, newest_s, width_s) {
    const after_s = (1 - this.settings.before) * width_s;
    let another = false;
    for (let n = 0; n < kMaxShots && this.on && !this.done; ++n) {
      if (this.pending_s === null) {
        const {at_s, next_s} = this.find(capture, id);
        this.pending_s = at_s;
        this.from_s = next_s;
      }
      if (this.pending_s === null || newest_s < this.pending_s + after_s) break;
      this.shot_s = this.pending_s;
      this.from_s = Math.max(this.from_s, this.shot_s + after_s);
      this.pending_s = null;
      this.done = this.settings.mode === 'single';
      another = true;
    }
    return another;
  }

  /// Returns the standing window {from_s, to_s}; null: running.
  window(newest_s, width_s) {
    if (!this.on || this.shot_s === null) return null;
    const from_s = this.shot_s - this.settings.before * width_s;
    const to_s = from_s + width_s;
    const waited = newest_s - to_s > Math.max(kPatience_s, 2 * width_s);
    return this.settings.mode === 'auto' && waited ? null : {from_s, to_s};
  }
}
