// Moves drives by commands, as a host does, with the keys of a scenario's [[send]].

import {el, labelled} from './dom.js';
import {command} from './choice.js';
import {numbersOf} from './fields.js';
import {t} from './words.js';

const number = (label, value, attributes = {}) => el('input', {type: 'number', step: 'any', value, 'aria-label': t(label), ...attributes});
const button = (text, onclick, attributes = {}) => el('button', {type: 'button', onclick, ...attributes}, text);

export function jogPanel() {
  const speed = number('jog_speed_label', 90);
  const angle = number('jog_angle_label', 90);
  const within = number('jog_max_speed_label', 360, {min: 1, max: 65535, step: 1});
  const say = (word, attributes = {}) =>
    button(t(word), () => command({command: word}, t('jog_sent', {what: t(word)})), {'aria-label': t(`jog_${word}`), ...attributes});
  const turn = async (sign) => {
    const numbers = numbersOf(speed);
    if (numbers) await command({command: 'speed', speed_dps: sign * numbers[0]}, t('jog_sent', {what: t('speed')}));
  };
  const move = async (word, key, sign, what) => {
    const numbers = numbersOf(angle, within);
    if (numbers) await command({command: word, [key]: sign * numbers[0], max_speed_dps: numbers[1]}, t('jog_sent', {what}));
  };
  return [
    el('div', {class: 'row'}, say('run'), say('stop'), say('off', {class: 'danger'})),
    el('div', {class: 'row'}, labelled(t('speed'), speed), '°/s', button('−', () => turn(-1), {'aria-label': t('jog_back')}), button('+', () => turn(1), {'aria-label': t('jog_forth')})),
    el('div', {class: 'row'}, labelled(t('angle'), angle), '°', labelled(t('jog_max_speed'), within), '°/s'),
    el('div', {class: 'row'}, button(t('jog_go'), () => move('position_2', 'angle_deg', 1, t('jog_go'))),
      button(t('jog_less'), () => move('position_6', 'turn_deg', -1, t('jog_less'))), button(t('jog_more'), () => move('position_6', 'turn_deg', 1, t('jog_more')))),
    el('p', {class: 'dim', text: t('jog_hint')}),
  ];
}
