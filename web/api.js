// Client of the control interface (docs/reference/control-api.md): requests, and WebSockets that reconnect.

import {t} from './words.js';

const kBase = '/api/v1';
const kTokenKey = 'lk-emu-token';
const kAnswer_ms = 5000;
const kRetry_ms = [300, 1000, 2000, 3000];

let token = sessionStorage.getItem(kTokenKey) ?? '';
let asking = null;

export class Refused extends Error {
  constructor(status, where, reason) {
    super(`${where}: ${reason}`);
    this.status = status;
  }
}

/// Asks the user for the token, once for all pending requests. `refused`: lk-emu has refused a token.
function askForToken(refused) {
  asking ??= new Promise((resolve) => {
    const dialog = document.getElementById('token');
    dialog.querySelector('.wrong').hidden = !refused;
    dialog.querySelector('input').value = '';
    dialog.addEventListener('close', () => {
      token = dialog.querySelector('input').value;
      sessionStorage.setItem(kTokenKey, token);
      asking = null;
      resolve();
    }, {once: true});
    dialog.showModal();
  });
  return asking;
}

async function ask(method, path, body) {
  const headers = {};
  const used = token;
  if (token) headers.Authorization = `Bearer ${token}`;
  if (body !== undefined) headers['Content-Type'] = 'application/json';
  const answer = await fetch(kBase + path, {
    method, headers, cache: 'no-store', body: body === undefined ? undefined : JSON.stringify(body),
    signal: method === 'GET' ? AbortSignal.timeout(kAnswer_ms) : undefined})  // others may take hours (advance)
    .catch(() => { throw new Error(t('lost')); });
  if (answer.status === 401) {
    if (used === token) await askForToken(token !== '');
    return ask(method, path, body);
  }
  const json = await answer.json();
  if (!answer.ok) throw new Refused(answer.status, json.error?.where ?? path, json.error?.reason ?? answer.statusText);
  return json;
}

export const get = (path) => ask('GET', path);
export const put = (path, body) => ask('PUT', path, body);
export const post = (path, body) => ask('POST', path, body);
export const remove = (path) => ask('DELETE', path);

/// A page can pass its token to a WebSocket only as a subprotocol.
function protocols() {
  if (!token) return [];
  const bytes = new TextEncoder().encode(token);
  return ['lk-emu', `bearer.${Array.from(bytes, (b) => b.toString(16).padStart(2, '0')).join('')}`];
}

/// Receives messages of a WebSocket, parsed, until closed here. Reconnects after a failure. Calls `onOpen` on each
/// connection, `onClose` when it breaks or is refused.
export function stream(path, {onMessage, onOpen = () => {}, onClose = () => {}}) {
  let socket = null;
  let closed = false;
  let failures = 0;
  let timer = 0;
  const open = () => {
    const scheme = location.protocol === 'https:' ? 'wss:' : 'ws:';
    socket = new WebSocket(`${scheme}//${location.host}${kBase}${path}`, protocols());
    socket.onopen = () => {
      failures = 0;
      onOpen();
    };
    socket.onmessage = (event) => {
      if (!closed) onMessage(JSON.parse(event.data));
    };
    socket.onclose = () => {
      if (closed) return;
      onClose();
      timer = setTimeout(open, kRetry_ms[Math.min(failures++, kRetry_ms.length - 1)]);
    };
  };
  open();
  return {
    close() {
      closed = true;
      clearTimeout(timer);
      socket.close();
    },
  };
}
