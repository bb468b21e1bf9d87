// Controls of simulated time: run, step, speed.

import {el, labelled, setText} from './dom.js';
import {post, put, remove} from './api.js';
import {attempt} from './choice.js';
import {numbersOf} from './fields.js';
import {clockText, figures} from './format.js';
import {on, store} from './store.js';
import {t} from './words.js';

const kSteps_s = [0.001, 0.01, 0.1, 1];

export function clockPanel() {
  const setMode = (mode) => attempt(() => put('/clock', {mode}), t('clock_is', {mode: t(mode)}));
  const step = (by_s) => attempt(() => post('/clock/advance', {by_s}), (answer) => t('time_is', {s: figures(answer.time_s, 9)}));
  const button = (text, onclick, attributes = {}) => el('button', {type: 'button', onclick, ...attributes}, text);
  const factor = el('input', {type: 'number', min: 0.001, max: 1000, step: 'any', value: 0.1});
  const by = el('input', {type: 'number', min: 0, step: 'any', value: 0.02});
  const realtime = button(t('real_time'), () => setMode('realtime'));
  const stepped = button(t('stop_clock'), () => setMode('stepped'), {title: t('time_stands')});
  const scaled = button(t('scale'), () => { if (numbersOf(factor)) setMode(`x${Number(factor.value)}`); });
  const steps = [...kSteps_s.map((s) => button(s < 1 ? `+${s * 1000} ms` : `+${s} s`, () => step(s))), button(t('step'), () => { if (numbersOf(by)) step(Number(by.value)); })];
  const end = button(t('end'), () => attempt(() => remove('/clock/advance')), {title: t('end_about')});
  const says = el('p', {class: 'dim'});
  on('change', () => {
    if (!store.status) return;
    const {mode, time_s, slipped_s, advancing} = store.status.clock;
    setText(says, t('clock_says', {time: clockText(time_s), mode: t(mode)}) + (advancing ? t('clock_advancing') : '') +
      (slipped_s ? t('clock_slipped', {s: figures(slipped_s, 3)}) : ''));
    realtime.setAttribute('aria-pressed', mode === 'realtime');
    stepped.setAttribute('aria-pressed', mode === 'stepped');
    scaled.setAttribute('aria-pressed', mode.startsWith('x'));
    for (const one of steps) one.disabled = mode !== 'stepped' || advancing;
    end.disabled = !advancing;
  }, says);
  return [says, el('div', {class: 'row'}, realtime, stepped, labelled('×', factor), scaled),
    el('div', {class: 'row'}, ...steps.slice(0, -1)), el('div', {class: 'row'}, labelled(t('by'), by), 's', steps.at(-1), end)];
}
