// Named layouts of the scope: choice and display. The browser stores them; files transfer them.

import {el, note} from './dom.js';
import {defaults, kErrors, kKinds, kModes} from './trigger.js';
import {t} from './words.js';

const kKept = 'lk-emu-scope-layouts';
const kFormat = 1;
const kMaxText = 1_000_000;
const kMaxName = 60;

const isText = (value) => typeof value === 'string' && value.length < 100;
const isNumber = (value) => Number.isFinite(value);
const isList = (of) => (value) => Array.isArray(value) && value.length < 1000 && value.every(of);
const isRange = (value) => isList(isNumber)(value) && value.length === 2 && value[0] < value[1];

/// Parts of a layout, with a check of each.
const kParts = {
  drives: isList(isText),
  signals: isList(isText),
  hidden: isList(isText),
  rate_Hz: (value) => isNumber(value) && value >= 0.1 && value <= 20_000,
  width_s: (value) => isNumber(value) && value >= 0.001 && value <= 600,
  ranges: (value) => typeof value === 'object' && value !== null && Object.values(value).every(isRange),
  spectra: (value) => typeof value === 'boolean',
  trigger: (value) => typeof value === 'object' && value !== null,
};
const kTriggerParts = {
  mode: (value) => kModes.includes(value), kind: (value) => kKinds.includes(value), drive: isText, signal: isText,
  edge: (value) => ['rising', 'falling'].includes(value), level: isNumber, error: (value) => ['any', ...kErrors].includes(value),
  command: (value) => isText(value) && /^[0-9A-F]{2}$/.test(value), before: (value) => isNumber(value) && value >= 0 && value <= 0.9,
};

function checkedParts(object, parts, where) {
  const clean = {};
  for (const [key, fits] of Object.entries(parts)) {
    if (!Object.hasOwn(object, key)) throw new Error(`${where}: ${key} is missing`);
    if (!fits(object[key])) throw new Error(`${where}: ${key} is ${JSON.stringify(object[key])?.slice(0, 60)}`);
    clean[key] = object[key];
  }
  return clean;
}

/// Returns a copy with only valid parts; throws if a part is missing or invalid.
export function checked(layout, name) {
  if (typeof layout !== 'object' || layout === null) throw new Error(`${name}: no layout`);
  const clean = checkedParts(layout, kParts, name);
  clean.trigger = checkedParts({...defaults(), ...layout.trigger}, kTriggerParts, `${name}: trigger`);
  return clean;
}

export const print = (layouts) => JSON.stringify({lk_emu_scope_layouts: kFormat, layouts}, null, 2);

/// Parses {name: layout}. Throws an Error with the reason.
export function parse(text) {
  if (text.length > kMaxText) throw new Error('too long');
  const json = JSON.parse(text);
  if (json?.lk_emu_scope_layouts !== kFormat || typeof json.layouts !== 'object' || json.layouts === null) throw new Error('not layouts of the scope');
  return Object.fromEntries(Object.entries(json.layouts).map(([name, layout]) => [name.slice(0, kMaxName), checked(layout, name)]));
}

function kept() {
  try {
    return parse(localStorage.getItem(kKept) ?? print({}));
  } catch (problem) {
    console.debug(problem);  // from another version: discarded
    return {};
  }
}

/// A row of controls; `current` returns the present layout, `apply` shows another.
export class Layouts {
  constructor({current, apply}) {
    this.current = current;
    this.apply = apply;
    this.all = kept();
    this.list = el('select', {'aria-label': t('layout'), onchange: () => this.choose()});
    this.name = el('input', {type: 'text', 'aria-label': t('layout_name'), placeholder: t('layout_name'), maxlength: kMaxName, size: 12,
      onkeydown: (event) => { if (event.key === 'Enter') this.save(); }});
    this.file = el('input', {type: 'file', accept: '.json,application/json', hidden: true, onchange: () => this.read()});
    const button = (key, onclick) => el('button', {type: 'button', title: t(`layout_${key}_about`), onclick}, t(`layout_${key}`));
    this.root = el('div', {class: 'row', role: 'group', 'aria-label': t('layouts')}, this.list, this.name,
      button('load', () => this.choose()), button('save', () => this.save()), button('remove', () => this.remove()),
      button('export', () => this.write()), button('import', () => this.file.click()), this.file);
    this.show('');
  }

  show(name) {
    this.list.replaceChildren(el('option', {value: '', text: '–'}), ...Object.keys(this.all).sort().map((one) => el('option', {value: one, text: one})));
    this.list.value = name;
  }

  keep(name) {
    try {
      localStorage.setItem(kKept, print(this.all));
    } catch (problem) {
      note(t('layout_not_kept', {reason: problem.message}), true);
    }
    this.show(name);
  }

  choose() {
    const name = this.list.value;
    if (!name) return;
    this.name.value = name;
    this.apply(structuredClone(this.all[name]));
  }

  save() {
    const name = this.name.value.trim();
    if (!name) {
      note(t('layout_needs_name'), true);
      this.name.focus();
      return;
    }
    this.all = {...this.all, [name]: structuredClone(this.current())};
    this.keep(name);
    note(t('layout_saved', {name}));
  }

  remove() {
    const name = this.list.value;
    if (!name) return;
    const {[name]: gone, ...others} = this.all;
    this.all = others;
    this.keep('');
  }

  write() {
    const link = el('a', {href: URL.createObjectURL(new Blob([print(this.all), '\n'], {type: 'application/json'})), download: 'lk-emu-layouts.json'});
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
  }

  async read() {
    const [file] = this.file.files;
    if (!file) return;
    try {
      const read = parse(await file.text());
      this.all = {...this.all, ...read};
      this.keep('');
      note(t('layouts_read', {n: Object.keys(read).length}));
    } catch (problem) {
      note(t('layouts_bad', {file: file.name, reason: problem.message}), true);
    }
    this.file.value = '';
  }
}
