// Controls of the scope's trigger.

import {el, labelled, note, setText} from './dom.js';
import {figures} from './format.js';
import {kErrors, kKinds, kModes} from './trigger.js';
import {driveKey, driveName, store} from './store.js';
import {name as nameOf, t} from './words.js';

const kShares = [0, 0.1, 0.25, 0.5, 0.75, 0.9];

const options = (list, text) => list.map((value) => el('option', {value, text: text(value)}));

export class TriggerControls {
  /// `onChange` is called when the settings have changed and the trigger is armed again.
  constructor(trigger, onChange) {
    this.trigger = trigger;
    this.onChange = onChange;
    const select = (key, label, list, text) => el('select', {'aria-label': t(label), onchange: () => this.take(key)}, ...options(list, text));
    this.fields = {
      mode: select('mode', 'trigger', kModes, (mode) => t(`trigger_${mode}`)),
      kind: select('kind', 'trigger_kind', kKinds, (kind) => t(`trigger_on_${kind}`)),
      drive: select('drive', 'trigger_drive', [], String),
      signal: select('signal', 'trigger_signal', [], String),
      edge: select('edge', 'trigger_edge', ['rising', 'falling'], (edge) => t(`trigger_${edge}`)),
      level: el('input', {type: 'number', step: 'any', 'aria-label': t('trigger_level'), onchange: () => this.take('level')}),
      error: select('error', 'trigger_error', ['any', ...kErrors], (error) => (error === 'any' ? t('trigger_any_error') : nameOf('errors', error))),
      command: el('input', {type: 'text', size: 4, maxlength: 4, class: 'mono', 'aria-label': t('trigger_command'), onchange: () => this.take('command')}),
      before: select('before', 'trigger_before_label', kShares, (share) => `${share * 100} %`),
    };
    const {mode, kind, drive, signal, edge, level, error, command, before} = this.fields;
    this.before = labelled(t('trigger_before'), before);
    this.state = el('span', {class: 'dim', id: 'trigger-state'});
    this.root = el('div', {class: 'row', role: 'group', 'aria-label': t('trigger'), 'data-needs-program': true}, labelled(t('trigger'), mode), kind, drive, signal, edge, level, error, command,
      this.before, this.state);
  }

  take(key) {
    const {settings} = this.trigger;
    const field = this.fields[key];
    if (key === 'level' || key === 'before') {
      if (field.value !== '' && Number.isFinite(Number(field.value))) settings[key] = Number(field.value);
    } else if (key === 'command') {
      const byte = /^(?:0x)?([0-9a-f]{1,2})$/i.exec(field.value.trim());
      if (!byte) note(t('trigger_bad_command'), true);
      else settings.command = byte[1].toUpperCase().padStart(2, '0');
    } else {
      settings[key] = field.value;
    }
    this.show();
    this.onChange();
  }

  /// Builds the lists again, because another program may have other drives.
  build() {
    const {drive, signal} = this.fields;
    drive.replaceChildren(...store.drives.map(({bus, id}) => el('option', {value: driveKey(bus, id), text: t('drive', {name: driveName(bus, id)})})));
    signal.replaceChildren(...options(store.signals.map(({name}) => name), String));
    this.show();
  }

  show() {
    const {settings} = this.trigger;
    if (!store.drives.some(({bus, id}) => driveKey(bus, id) === settings.drive)) settings.drive = store.drives.length ? driveKey(store.drives[0].bus, store.drives[0].id) : '';
    if (!store.signals.some(({name}) => name === settings.signal)) settings.signal = store.signals[0]?.name ?? '';
    for (const [key, field] of Object.entries(this.fields)) field.value = settings[key];
    const on = settings.mode !== 'off';
    const is = (...kinds) => on && kinds.includes(settings.kind);
    const {kind, drive, signal, edge, level, error, command} = this.fields;
    for (const [field, shown] of [[kind, on], [drive, on], [this.before, on], [signal, is('level')], [edge, is('level')], [level, is('level')],
      [error, is('error')], [command, is('command')]]) field.hidden = !shown;
  }

  showState() {
    const {on, shot_s, done} = this.trigger;
    const text = !on ? '' : shot_s === null ? t('trigger_waits') : t(done ? 'trigger_done' : 'trigger_at', {time: figures(shot_s, 9)});
    setText(this.state, text);
  }
}
