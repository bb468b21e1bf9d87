// Language of the page: ?lang=zh, else the user's choice, else lk-emu --lang, else the browser's.

import {kEnglish} from './words_en.js';

const kKept = 'lk-emu-lang';

function wanted() {
  const asked = new URLSearchParams(location.search).get('lang');
  return asked ?? localStorage.getItem(kKept) ?? (document.documentElement.dataset.lang || navigator.language);
}

async function chinese() {
  const [{kChinese}, {kChineseNames}, {kChineseFaults}] =
    await Promise.all([import('./words_zh.js'), import('./words_zh_names.js'), import('./words_zh_faults.js')]);
  return {words: kChinese, names: {...kChineseNames, ...kChineseFaults}};
}

export const language = wanted().toLowerCase().startsWith('zh') ? 'zh' : 'en';
const {words, names} = language === 'zh' ? await chinese() : {words: kEnglish, names: {}};

/// Returns a text with {n} replaced by its value: t('lost_frames', {n: 3}).
export function t(key, values = {}) {
  return (words[key] ?? kEnglish[key] ?? key).replace(/\{(\w+)\}/g, (all, name) => values[name] ?? all);
}

/// Translates a name of the program: name('errors', 'under_voltage'). In English the name itself, without underscores.
export const name = (group, key) => names[group]?.[key] ?? key.replaceAll('_', ' ');

/// Translates a sentence of the program if known.
export const about = (group, key, english) => names[group]?.[key] ?? english;

/// Translates a fault's default name, its kind with an optional number; leaves other names.
export function faultName(given, kind) {
  const number = given.startsWith(kind) ? /^(-\d+)?$/.exec(given.slice(kind.length)) : null;
  return number ? name('fault_names', kind) + number[0] : given;
}

/// Returns a text that an object has in both languages, e.g. said(advice, 'what') reads `what` or `what_zh`.
export const said = (object, key) => (language === 'zh' && object[`${key}_zh`]) || object[key] || '';

/// Reloads the page in the other language at the same place.
export function switchLanguage() {
  const other = language === 'zh' ? 'en' : 'zh';
  localStorage.setItem(kKept, other);
  const address = new URL(location.href);
  address.searchParams.delete('lang');
  if (address.href === location.href) location.reload();
  else location.replace(address);
}

/// Fills in the texts of elements in index.html by their data-t attributes.
export function translatePage() {
  document.documentElement.lang = language === 'zh' ? 'zh-CN' : 'en';
  for (const node of document.querySelectorAll('[data-t]')) node.textContent = t(node.dataset.t);
  for (const node of document.querySelectorAll('[data-t-label]')) {
    node.setAttribute('aria-label', t(node.dataset.tLabel));
    if (node.title) node.title = t(node.dataset.tLabel);
  }
}
