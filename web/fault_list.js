// The faults so far (GET /faults), polled while a listener is visible.

import {get} from './api.js';
import {on, store} from './store.js';

const kPeriod_ms = 700;

const listeners = new Map();  // by listener: its node
let faults = [];
let asking = false;
let askedAt = -Infinity;

export const isGoing = (fault) => ['active', 'armed', 'paused'].includes(fault.state);

/// Returns the current faults of a drive; without an ID, those of the whole bus.
export const goingOn = (bus, id = null) => faults.filter((fault) =>
  fault.bus === bus && isGoing(fault) && (id === null ? !fault.ids.length : fault.ids.includes(id)));

/// Calls the listener with every answer while `node` is visible.
export function onFaults(listener, node) {
  listeners.set(listener, node);
}

const isSeen = (node) => node.isConnected && !node.closest('[hidden]');

async function ask() {
  asking = true;
  askedAt = performance.now();
  try {
    faults = await get('/faults');
    for (const [listener, node] of listeners) if (isSeen(node)) listener(faults);
  } catch { /* the next time */ }
  asking = false;
}

on('program', () => { faults = []; });
on('change', () => {
  for (const [listener, node] of listeners) if (!node.isConnected) listeners.delete(listener);
  if (asking || !store.connected || performance.now() - askedAt < kPeriod_ms) return;
  if ([...listeners.values()].some(isSeen)) ask();
});
