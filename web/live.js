// What moves on dials: the newest sample of each drive, for as long as somebody looks.

import {stream} from './api.js';
import {buses, clockFactor, driveKey, on, store} from './store.js';

const kSignals = ['true_angle_deg', 'angle_deg', 'angle_ref_deg', 'encoder', 'true_speed_dps', 'speed_dps', 'iq_A',
  'voltage_V', 'temperature_C', 'driver_temperature_C', 'bus_current_A', 'power', 'errors', 'bridge_on', 'alive'];
const kFrames_Hz = 60;  // of the wall

const values = new Map();  // by drive: {signal: value}
let streams = [];
let wanted = false;
let rate_Hz = 0;

/// The newest values of a drive: of the stream, or of the last answer where none has come.
export const liveValues = (drive) => values.get(driveKey(drive.bus, drive.id)) ?? drive.signals;

function take(bus, samples) {
  const sample = Array.isArray(samples) ? samples.at(-1) : samples;
  for (const [id, ...row] of sample.rows ?? []) {
    const key = driveKey(bus, id);
    let now = values.get(key);
    if (!now) values.set(key, now = {});
    for (let n = 0; n < row.length; ++n) now[kSignals[n]] = row[n];
  }
}

function close() {
  streams.forEach((one) => one.close());
  streams = [];
  values.clear();
}

function open() {
  close();
  const drives = store.drives.length || 1;
  const fastest = 190_000 / (drives * kSignals.length);
  rate_Hz = Math.min(fastest, 20_000, Math.max(0.1, kFrames_Hz / (clockFactor() || 1)));
  for (const {bus} of buses()) {
    const query = `bus=${encodeURIComponent(bus)}&signals=${kSignals}&rate_Hz=${rate_Hz}`;
    streams.push(stream(`/telemetry?${query}`, {onMessage: (samples) => take(bus, samples)}));
  }
}

/// Whether anybody looks.
export function wantLive(yes) {
  if (yes === wanted) return;
  wanted = yes;
  if (yes && store.status) open();
  else close();
}

on('program', () => wanted && open());
on('change', () => {
  if (!store.connected) values.clear();
  if (store.status?.clock.mode === 'stepped' && !store.status.clock.advancing) values.clear();
  if (!wanted || !store.status) return;
  const now_Hz = kFrames_Hz / (clockFactor() || 1);
  if (Math.abs(Math.log(now_Hz / rate_Hz)) > 0.7 && rate_Hz < kFrames_Hz * 1000) {
    const possible = Math.min(20_000, Math.max(0.1, now_Hz));
    if (Math.abs(possible - rate_Hz) > 0.01 * rate_Hz) open();
  }
});
