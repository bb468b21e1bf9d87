// The kept frames of all buses in order of time, and those that pass the filter.

import {frameText} from './traffic_row.js';
import {driveKey} from './store.js';

const kMax = 50_000;    // frames kept

/// Drives are keys, because IDs are ambiguous with several buses.
export const filter = {drives: new Set(), commands: null, from: '', marked: false, text: ''};

export const kept = {
  all: [],      // oldest first
  shown: [],    // frames that pass
  dropped: 0,   // dropped from the front of `shown` since the filter was set
};

let lost = new Map();  // by bus

function passes(frame) {
  const {drives} = filter;
  if (drives.size && !drives.has(driveKey(frame.bus, frame.id))) {
    const ofItsBus = frame.id === 0 && [...drives].some((key) => key.startsWith(driveKey(frame.bus, '')));
    if (!ofItsBus) return false;
  }
  if (filter.from && frame.from !== filter.from) return false;
  if (filter.marked && !frame.mark && !frame.advice) return false;
  if (filter.commands && !filter.commands.has(frame.command)) return false;
  return !filter.text || frameText(frame).toLowerCase().includes(filter.text);
}

export function refilter() {
  kept.shown = kept.all.filter(passes);
  kept.dropped = 0;
}

export function forget() {
  kept.all = [];
  lost = new Map();
  refilter();
}

/// Inserts in order of time, because the buses' streams are not synchronised.
function insert(list, frame) {
  let place = list.length;
  while (place > 0 && list[place - 1].time_s > frame.time_s) --place;
  if (place === list.length) list.push(frame);
  else list.splice(place, 0, frame);
}

export function keep(bus, frames) {
  for (const frame of frames) {
    frame.bus = bus;
    insert(kept.all, frame);
    if (passes(frame)) insert(kept.shown, frame);
  }
  if (kept.all.length <= kMax * 1.2) return;
  const before = kept.shown.length;
  kept.all = kept.all.slice(-kMax);
  kept.shown = kept.all.filter(passes);
  kept.dropped += before - kept.shown.length;
}

/// Sets the total number of lost frames of a bus, as counted by its stream.
export const tellLost = (bus, count) => lost.set(bus, count);
export const lostFrames = () => [...lost.values()].reduce((sum, count) => sum + count, 0);

/// Returns the previous shown frame on the same bus, for the gap.
export function frameBefore(place) {
  const {shown} = kept;
  let n = place - 1;
  while (n >= 0 && shown[n].bus !== shown[place].bus) --n;
  return shown[n] ?? null;
}

const kSameInstant_s = 1.5e-6;  // clocks are read in whole microseconds

/// Returns a frame of that instant, preferably a host's; null: none is kept. `bus` null: any bus.
export function frameAt(bus, time_s) {
  const then = kept.all.filter((frame) => (!bus || frame.bus === bus) && Math.abs(frame.time_s - time_s) < kSameInstant_s);
  return then.find((frame) => frame.from === 'host') ?? then[0] ?? null;
}
