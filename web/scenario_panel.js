// A scenario on the running bus: started, watched, judged.

import {get, post, remove} from './api.js';
import {el, labelled, setText} from './dom.js';
import {attempt} from './choice.js';
import {figures, words} from './format.js';
import {on, store} from './store.js';

const kColours = {passed: 'good', failed: 'bad', invalid: 'bad', running: 'warn', open: 'warn'};

const chip = (text) => el('span', {class: `chip ${kColours[text] ?? ''}`, text});

function verdict(report) {
  const rows = [
    ...report.expectations.map((one) => el('tr', {}, el('td', {}, chip(one.status)), el('td', {}, one.says || one.expected),
      el('td', {class: 'dim', text: one.says ? `${one.expected}: ${one.measured}` : one.measured}))),
    ...report.faults.map((one) => el('tr', {}, el('td', {}, chip(one.took_effect ? 'took effect' : 'no effect')), el('td', {text: one.name}), el('td', {class: 'dim', text: one.evidence}))),
  ];
  return el('table', {}, el('tbody', {}, ...rows));
}

export function scenarioPanel() {
  const select = el('select', {id: 'scenario'}, el('option', {value: '', text: 'choose one'}));
  const about = el('p', {class: 'dim about'});
  const file = el('input', {type: 'file', accept: '.toml'});
  const start = el('button', {type: 'button', class: 'main', id: 'scenario-start'}, 'Start');
  const stop = el('button', {type: 'button', onclick: () => attempt(() => remove('/scenario'), 'ended')}, 'Stop');
  const head = el('p', {class: 'row', id: 'scenario-state'});
  const result = el('div', {class: 'scroll'});
  let delivered = [];
  get('/scenarios').then((list) => {
    delivered = list;
    select.append(...list.map((one) => el('option', {value: one.file, text: words(one.name)})));
  }, () => {});
  select.addEventListener('change', () => setText(about, delivered.find((one) => one.file === select.value)?.about ?? ''));
  start.addEventListener('click', () => attempt(async () => {
    const request = file.files.length ? {toml: await file.files[0].text()} : {file: select.value};
    return post('/scenario', request);
  }, (state) => `${state.name} has begun`));
  let shown = '';
  on('change', async () => {
    const state = store.status?.scenario;
    stop.disabled = state?.state !== 'running';
    if (!state || !head.isConnected || head.closest('[hidden]')) return;
    head.replaceChildren(chip(state.state), `${words(state.name)}, ${figures(state.time_s, 4)} of ${figures(state.duration_s)} s`);
    try {
      const report = await get('/scenario');
      const text = JSON.stringify([report.expectations, report.faults]);
      if (text === shown) return;
      shown = text;
      result.replaceChildren(verdict(report));
    } catch { /* the next time */ }
  });
  return [el('div', {class: 'row'}, labelled('delivered', select), labelled('or a file', file)), about, el('div', {class: 'row'}, start, stop), head, result];
}
