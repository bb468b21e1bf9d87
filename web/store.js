// State of the program, polled; calls listeners on changes.

import {get} from './api.js';

const kPeriod_ms = 400;
const kRetry_ms = 1000;

export const store = {
  connected: false,
  status: null,       // GET /status
  drives: [],         // GET /drives; the registers are those of the start
  rates: new Map(),   // by bus: {load, ratio}; by drive: replies per second
  signals: [],
  kinds: [],
  mayWrite: false,
};

let byKey = new Map();  // drives

const listeners = {change: new Map(), program: new Map()};  // by listener: its node, or null

/// 'change': new answers. 'program': the first answer of a program. A listener with a node is removed once the page no
/// longer contains that node.
export function on(event, listener, node = null) {
  listeners[event].set(listener, node);
}

function tell(event) {
  for (const [listener, node] of listeners[event]) {
    if (node && !node.isConnected) listeners[event].delete(listener);
    else listener();
  }
}

export const driveKey = (bus, id) => `${bus}/${id}`;
export const driveOf = (key) => byKey.get(key);
export const buses = () => store.status?.buses ?? [];
export const busTime = (bus) => buses().find((one) => one.bus === bus)?.time_s ?? 0;
/// With several buses a drive's name includes its bus.
export const driveName = (bus, id) => (buses().length > 1 ? `${bus} ${id}` : String(id));

/// Simulated seconds per real second, as the clock is set; 0: stepped.
export function clockFactor() {
  const mode = store.status?.clock.mode ?? 'realtime';
  if (mode === 'stepped') return 0;
  return mode === 'realtime' ? 1 : Number(mode.slice(1)) || 1;
}

// --- rates from differences between answers

const kSpan_ms = 1500;  // rates average over this time or a little more
let history = [];

function perSecond(now, then, seconds) {
  return seconds > 0 ? (now - then) / seconds : null;
}

function updateRates(at_ms) {
  const sample = {at_ms, time_s: store.status.clock.time_s, buses: new Map(), replies: new Map()};
  for (const bus of store.status.buses) {
    sample.buses.set(bus.bus, {time_s: bus.time_s, busy_s: bus.counters.wire_busy_s});
  }
  for (const drive of store.drives) sample.replies.set(driveKey(drive.bus, drive.id), drive.counters.sent);
  history.push(sample);
  while (history.length > 2 && at_ms - history[1].at_ms >= kSpan_ms) history.shift();
  const first = history[0];
  const rates = new Map();
  rates.set('clock', perSecond(sample.time_s, first.time_s, (at_ms - first.at_ms) / 1000));
  for (const [bus, now] of sample.buses) {
    const then = first.buses.get(bus) ?? now;
    rates.set(bus, perSecond(now.busy_s, then.busy_s, now.time_s - then.time_s));
    for (const [key, replies] of sample.replies) {
      if (!key.startsWith(`${bus}/`)) continue;
      rates.set(key, perSecond(replies, first.replies.get(key) ?? replies, now.time_s - then.time_s));
    }
  }
  store.rates = rates;
}

// --- polling

let told = null;  // last status that was sent to the listeners

/// Fetches data that is constant while a program runs.
async function learn(status) {
  const [signals, kinds] = await Promise.all([get('/signals'), get('/faults/kinds')]);
  return {signals, kinds, mayWrite: status.pages_may_write};
}

/// Keys that change while a program runs, without registers, which are most of an answer.
const kChanging = '?fields=bus,id,state,alive,errors,signals,setpoint,surroundings,counters';

/// `whole`: fetches all of each drive.
async function lookAtDrives(whole) {
  const drives = await get(`/drives${whole ? '' : kChanging}`);
  if (whole) return drives;
  const before = drives.map(({bus, id}) => driveOf(driveKey(bus, id)));
  // A drive with a new ID is unknown.
  return before.includes(undefined) ? lookAtDrives(true) : drives.map((drive, n) => ({...before[n], ...drive}));
}

/// Updates all or nothing: after a failed request the next poll repeats all.
async function look() {
  const status = await get('/status');
  const other = told === null || told.pid !== status.pid || status.clock.time_s < told.clock.time_s;
  const learned = other ? await learn(status) : {};
  const drives = await lookAtDrives(other);
  if (other || !store.connected) history = [];
  Object.assign(store, learned, {status, drives, connected: true});
  byKey = new Map(drives.map((drive) => [driveKey(drive.bus, drive.id), drive]));
  updateRates(performance.now());
  if (other) tell('program');
  told = status;
}

/// Polls for ever.
export async function follow() {
  for (;;) {
    try {
      await look();
    } catch (problem) {
      store.connected = false;
      console.debug(problem);
    }
    tell('change');
    await new Promise((resolve) => setTimeout(resolve, store.connected ? kPeriod_ms : kRetry_ms));
  }
}
