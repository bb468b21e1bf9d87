// Runs a scenario on the running bus: start, progress, verdict.

import {get, post, remove} from './api.js';
import {el, labelled, setText} from './dom.js';
import {attempt} from './choice.js';
import {figures} from './format.js';
import {driveName, on, store} from './store.js';
import {name, t} from './words.js';

const kColours = {passed: 'good', failed: 'bad', invalid: 'bad', running: 'warn', open: 'warn'};

const chip = (word) => el('span', {class: `chip ${kColours[word] ?? ''}`, text: name('states', word), 'data-state': word});

function verdict(report) {
  const rows = [
    ...report.expectations.map((one) => el('tr', {}, el('td', {}, chip(one.status)), el('td', {}, one.says || one.expected),
      el('td', {class: 'dim', text: one.says ? `${one.expected}: ${one.measured}` : one.measured}))),
    ...report.faults.map((one) => el('tr', {}, el('td', {}, el('span', {class: 'chip', text: t(one.took_effect ? 'took_effect' : 'no_effect')})), el('td', {text: one.name}), el('td', {class: 'dim', text: one.evidence}))),
  ];
  // While it runs, all pending checks would be listed as invalid.
  const reasons = report.state === 'running' ? [] : report.invalid;
  const invalid = reasons.map((why) => el('tr', {}, el('td', {}, chip('invalid')), el('td', {colspan: 2, text: why})));
  return el('table', {}, el('tbody', {}, ...invalid, ...rows));
}

const kMaxNamed = 3;

/// Warns that the scenario was made for a robot other than the running one.
function robotText({robot, foreign}) {
  if (!foreign?.length) return '';
  const named = foreign.slice(0, kMaxNamed).map(({bus, id, meant, running}) =>
    t(running ? 'other_motor' : 'no_such_motor', {name: driveName(bus, id), meant, running}));
  if (foreign.length > kMaxNamed) named.push(t('and_more', {n: foreign.length - kMaxNamed}));
  return t('other_robot', {robot, drives: named.join('; ')});
}

export function scenarioPanel() {
  const select = el('select', {id: 'scenario'}, el('option', {value: '', text: t('choose_one')}));
  const about = el('p', {class: 'dim about'});
  const file = el('input', {type: 'file', accept: '.toml'});
  const start = el('button', {type: 'button', class: 'main', id: 'scenario-start'}, t('start_scenario'));
  const stop = el('button', {type: 'button', onclick: () => attempt(() => remove('/scenario'), t('ended'))}, t('stop_scenario'));
  const head = el('p', {class: 'row', id: 'scenario-state'});
  const robot = el('p', {class: 'warning', id: 'scenario-robot', hidden: true});
  const result = el('div', {class: 'scroll', tabindex: 0, role: 'group', 'aria-label': t('scenario'), hidden: true});
  let delivered = [];
  get('/scenarios').then((list) => {
    delivered = list;
    select.append(...list.map((one) => el('option', {value: one.file, text: name('scenarios', one.name)})));
  }, () => {});
  const tellAbout = () => setText(about, delivered.find((one) => one.file === select.value)?.about ?? '');
  // File or list: the last choice counts.
  select.addEventListener('change', () => {
    file.value = '';
    tellAbout();
  });
  file.addEventListener('change', () => {
    select.value = '';
    tellAbout();
  });
  start.addEventListener('click', () => attempt(async () => {
    if (!file.files.length && !select.value) throw new Error(t('choose_scenario'));
    const request = file.files.length ? {toml: await file.files[0].text()} : {file: select.value};
    return post('/scenario', request);
  }, (state) => t('has_begun', {name: name('scenarios', state.name)})));
  let shown = '';
  on('change', async () => {
    const state = store.status?.scenario;
    stop.disabled = state?.state !== 'running';
    if (!state || head.closest('[hidden]')) return;
    head.replaceChildren(chip(state.state), t('scenario_at', {name: name('scenarios', state.name), time: figures(state.time_s, 4), all: figures(state.duration_s)}));
    try {
      const report = await get('/scenario');
      const text = JSON.stringify([report.state, report.expectations, report.faults, report.invalid, report.foreign]);
      if (text === shown) return;
      shown = text;
      setText(robot, robotText(report));
      robot.hidden = !robot.textContent;
      result.replaceChildren(verdict(report));
      result.hidden = false;
    } catch { /* the next time */ }
  }, head);
  const controls = el('div', {class: 'scenario-controls'}, el('div', {class: 'row'}, labelled(t('shipped'), select), labelled(t('or_file'), file), start, stop), about);
  return [el('div', {class: 'scenario-panel'}, controls, el('div', {}, head, robot, result))];
}
