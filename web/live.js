// Values of the dials: the newest sample of each drive, streamed while a dial is visible.

import {stream} from './api.js';
import {buses, clockFactor, driveKey, on, store} from './store.js';

const kSignals = ['true_angle_deg', 'angle_deg', 'angle_ref_deg', 'encoder', 'true_speed_dps', 'speed_dps', 'iq_A',
  'voltage_V', 'temperature_C', 'driver_temperature_C', 'bus_current_A', 'power', 'errors', 'bridge_on', 'alive'];
const kFrames_Hz = 30;        // of real time, as the dials are drawn
const kMaxValues = 190_000;   // per second; the program allows 200,000
const kDigits = 8;            // 0.01° of 2700 turns

const values = new Map();  // by drive: {signal: value}
let streams = [];
let wanted = false;
let rate_Hz = 0;

/// Returns the newest values of a drive: from the stream, or from the last answer if no sample has come.
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

/// Rate that gives kFrames_Hz in real time at any speed of simulated time.
function wantedRate_Hz() {
  const most = Math.min(20_000, kMaxValues / ((store.drives.length || 1) * kSignals.length));
  return Math.min(most, Math.max(0.1, kFrames_Hz / (clockFactor() || 1)));
}

function open() {
  close();
  rate_Hz = wantedRate_Hz();
  for (const {bus} of buses()) {
    const query = `bus=${encodeURIComponent(bus)}&signals=${kSignals}&rate_Hz=${rate_Hz}&digits=${kDigits}`;
    streams.push(stream(`/telemetry?${query}`, {onMessage: (samples) => take(bus, samples)}));
  }
}

/// Sets whether a dial is visible.
export function wantLive(yes) {
  if (yes === wanted) return;
  wanted = yes;
  if (yes && store.status) open();
  else close();
}

on('program', () => wanted && open());
on('change', () => {
  // If no more samples come, the last answer is newer than the last sample.
  const {clock} = store.status ?? {};
  if (!store.connected || (clock?.mode === 'stepped' && !clock.advancing)) values.clear();
  if (wanted && clock && Math.abs(wantedRate_Hz() / rate_Hz - 1) > 0.05) open();
});
