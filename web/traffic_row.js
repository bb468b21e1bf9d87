// A row of the traffic table.

import {adviceOf} from './advice.js';
import {el} from './dom.js';
import {fixed} from './format.js';
import {buses, driveKey} from './store.js';
import {language, name as nameOf, said, t} from './words.js';

/// The program names frames in English. Other languages translate the name by the command byte, if it is known.
const nameOfFrame = (frame) => (language !== 'en' && frame.name ? nameOf('commands', frame.command) : frame.name);
const saysOfFrame = (frame) => said(frame, 'says');
const drawbackOf = (frame) => (frame.drawback ? nameOf('marks', frame.drawback) : '');

/// Returns all searchable text: what is displayed, and the program's own names.
export const frameText = (frame) => [nameOfFrame(frame), saysOfFrame(frame), drawbackOf(frame), frame.advice ?? '', frame.frame,
  frame.name, frame.values].join(' ');

export function frameRow(frame, before) {
  const gap = before ? frame.time_s - before.time_s : null;
  const whom = frame.id ? `drive=${driveKey(frame.bus, frame.id)}&` : '';  // without a drive, the scope keeps its choice
  const scope = el('a', {href: `#scope?${whom}time_s=${frame.time_s}`,
    'aria-label': t('instant_in_scope', {time: fixed(frame.time_s, 6)}), text: t('scope_link')});
  const known = frame.advice ? adviceOf(frame.bus, frame.id, frame.advice) : null;
  const says = saysOfFrame(frame);
  return el('tr', {class: `${frame.from} ${frame.mark ?? ''} ${frame.advice ? 'advised' : ''}`},
    el('td', {class: 'num', text: fixed(frame.time_s, 6)}), el('td', {class: 'num dim', text: gap === null ? '' : fixed(gap * 1000, 3)}),
    el('td', {text: buses().length > 1 ? frame.bus : ''}),
    el('td', {text: frame.from === 'host' ? `→ ${frame.id || t('to_all')}` : `← ${frame.id || '?'}`}),
    el('td', {class: 'mono', text: frame.command}), el('td', {text: nameOfFrame(frame), title: nameOfFrame(frame)}),
    el('td', {class: 'said', title: `${says}\n${frame.values}`.trim()}, frame.advice ? el('span', {class: 'chip warn', title: known ? said(known, 'what') : '', text: frame.advice}) : '', says ? ` ${says}` : '',
      frame.drawback ? el('strong', {text: ` ${drawbackOf(frame)}`}) : ''),
    el('td', {class: 'mono dim', text: frame.frame}), el('td', {}, scope));
}
