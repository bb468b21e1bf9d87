// Colours of the robot's joints by a chosen quantity.

import {Color} from './vendor/three.module.min.js';
import {goingOn} from './fault_list.js';
import {fixed} from './format.js';
import {liveValues} from './live.js';
import {driveKey, driveOf} from './store.js';

export const kColourings = ['current', 'temperature', 'error'];
const kLeastCurrent_A = 1;      // assumed: keeps noise dark
const kNone = NaN;              // a joint without a drive
const kState = {good: 0, free: 1, fault: 2, bad: 3};

/// Returns the values of one drive, in the order of kColourings.
function valuesOf(joint) {
  const drive = joint.bus === null ? null : driveOf(driveKey(joint.bus, joint.id));
  if (!drive) return [kNone, kNone, kNone];
  const now = liveValues(drive);
  const bad = now.alive === 0 || now.errors !== 0;
  const state = bad ? kState.bad : goingOn(drive.bus, drive.id).length ? kState.fault : now.bridge_on === 0 ? kState.free : kState.good;
  return now.alive === 0 ? [0, kNone, state] : [Math.abs(now.iq_A), now.temperature_C, state];
}

export const jointValues = (joints) => joints.flatMap(valuesOf);

const kColours = ['good', 'warn', 'bad', 'dim'];

/// The selected quantity and the ends of its scale.
export class Colouring {
  constructor(joints) {
    this.what = kColourings[0];
    this.most_A = kLeastCurrent_A;
    const drive = joints.map(({bus, id}) => bus !== null && driveOf(driveKey(bus, id))).find(Boolean);
    this.from_C = drive?.built.ambient_C ?? 25;
    this.palette = Object.fromEntries(kColours.map((name) => [name, new Color()]));
    this.mixed = new Color();
    this.to_C = drive?.registers.ram.protection.motor_temperature.threshold_C ?? 100;
  }

  /// Extends the scale of the current to the largest value so far.
  heed(values) {
    for (let n = 0; n < values.length; n += kColourings.length) if (values[n] > this.most_A) this.most_A = values[n];
  }

  /// Sets the colours from the page's style sheets.
  paint(colours) {
    for (const name of kColours) this.palette[name].set(colours[name]);
  }

  /// Returns the colour at a share of the scale. Its first half turns the hue, since a mix of green and orange is grey.
  ramp(share) {
    const {good, warn, bad} = this.palette;
    const at = 2 * Math.max(0, Math.min(1, share));
    return at < 1 ? this.mixed.copy(good).lerpHSL(warn, at) : this.mixed.lerpColors(warn, bad, at - 1);
  }

  /// Returns a joint's colour; valid until the next call.
  colour(values, joint) {
    const {good, warn, bad, dim} = this.palette;
    const value = values[joint * kColourings.length + kColourings.indexOf(this.what)];
    if (!Number.isFinite(value)) return dim;
    if (this.what === 'current') return this.ramp(value / this.most_A);
    if (this.what === 'temperature') return this.ramp((value - this.from_C) / (this.to_C - this.from_C));
    return [good, dim, warn, bad][value];
  }

  /// Returns a joint's state (kState) if the colours are those of states, else that of a healthy joint.
  state(values, joint) {
    const value = values[joint * kColourings.length + kColourings.indexOf('error')];
    return this.what === 'error' && Number.isFinite(value) ? value : kState.good;
  }

  /// Returns the labels at the ends of the legend; null: the legend has words.
  ends() {
    if (this.what === 'current') return [`0 A`, `${fixed(this.most_A, 1)} A`];
    if (this.what === 'temperature') return [`${fixed(this.from_C, 0)} °C`, `${fixed(this.to_C, 0)} °C`];
    return null;
  }
}
