// What the joints of the robot are coloured by.

import {Color} from './vendor/three.module.min.js';
import {goingOn} from './fault_list.js';
import {fixed} from './format.js';
import {liveValues} from './live.js';
import {driveKey, driveOf} from './store.js';

export const kColourings = ['current', 'temperature', 'error'];
const kLeastCurrent_A = 1;      // assumed: below, noise would be bright
const kNone = NaN;              // a joint without a drive
const kState = {good: 0, free: 1, fault: 2, bad: 3};

/// Of one drive, in the order of kColourings.
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

/// One way to colour, with the ends of its scale.
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

  /// The scale of the current is as long as the largest there has been.
  heed(values) {
    for (let n = 0; n < values.length; n += kColourings.length) if (values[n] > this.most_A) this.most_A = values[n];
  }

  /// Colours of the page, as style sheets say them.
  paint(colours) {
    for (const name of kColours) this.palette[name].set(colours[name]);
  }

  /// From little to much.
  ramp(share) {
    const {good, warn, bad} = this.palette;
    const at = 2 * Math.max(0, Math.min(1, share));
    return at < 1 ? this.mixed.lerpColors(good, warn, at) : this.mixed.lerpColors(warn, bad, at - 1);
  }

  /// Good until the next one is asked for.
  colour(values, joint) {
    const {good, warn, bad, dim} = this.palette;
    const value = values[joint * kColourings.length + kColourings.indexOf(this.what)];
    if (!Number.isFinite(value)) return dim;
    if (this.what === 'current') return this.ramp(value / this.most_A);
    if (this.what === 'temperature') return this.ramp((value - this.from_C) / (this.to_C - this.from_C));
    return [good, dim, warn, bad][value];
  }

  /// What stands at the ends of the legend; null: it has words of its own.
  ends() {
    if (this.what === 'current') return [`0 A`, `${fixed(this.most_A, 1)} A`];
    if (this.what === 'temperature') return [`${fixed(this.from_C, 0)} °C`, `${fixed(this.to_C, 0)} °C`];
    return null;
  }
}
