// Simulated time: as it goes, in steps, faster or slower.

import {el, labelled, setText} from './dom.js';
import {post, put, remove} from './api.js';
import {attempt} from './choice.js';
import {clockText, figures} from './format.js';
import {on, store} from './store.js';

const kSteps_s = [0.001, 0.01, 0.1, 1];

export function clockPanel() {
  const setMode = (mode) => attempt(() => put('/clock', {mode}), `the clock is ${mode}`);
  const step = (by_s) => attempt(() => post('/clock/advance', {by_s}), (answer) => `it is ${figures(answer.time_s, 9)} s`);
  const button = (text, onclick, attributes = {}) => el('button', {type: 'button', onclick, ...attributes}, text);
  const factor = el('input', {type: 'number', min: 0.001, max: 1000, step: 'any', value: 0.1});
  const by = el('input', {type: 'number', min: 0, step: 'any', value: 0.02});
  const realtime = button('Real time', () => setMode('realtime'));
  const stepped = button('Stop', () => setMode('stepped'), {title: 'time stands still'});
  const scaled = button('Scale', () => setMode(`x${Number(factor.value)}`));
  const steps = [...kSteps_s.map((s) => button(s < 1 ? `+${s * 1000} ms` : `+${s} s`, () => step(s))), button('Step', () => step(Number(by.value)))];
  const end = button('End', () => attempt(() => remove('/clock/advance')), {title: 'ends an advance that is under way'});
  const says = el('p', {class: 'dim'});
  on('change', () => {
    if (!store.status || !says.isConnected) return;
    const {mode, time_s, slipped_s, advancing} = store.status.clock;
    setText(says, `${clockText(time_s)} of simulated time, ${mode}${advancing ? ', advancing' : ''}` +
      (slipped_s ? `; ${figures(slipped_s, 3)} s slipped: the machine was too busy` : ''));
    realtime.setAttribute('aria-pressed', mode === 'realtime');
    stepped.setAttribute('aria-pressed', mode === 'stepped');
    scaled.setAttribute('aria-pressed', mode.startsWith('x'));
    for (const one of steps) one.disabled = mode !== 'stepped' || advancing;
    end.disabled = !advancing;
  });
  return [says, el('div', {class: 'row'}, realtime, stepped, labelled('×', factor), scaled),
    el('div', {class: 'row'}, ...steps.slice(0, -1)), el('div', {class: 'row'}, labelled('by', by), 's', steps.at(-1), end)];
}
