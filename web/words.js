// The language of the page: ?lang=zh, else what was chosen here, else lk-emu --lang, else the browser's.

import {kEnglish} from './words_en.js';
import {kChinese} from './words_zh.js';
import {kChineseFaults} from './words_zh_faults.js';
import {kChineseNames} from './words_zh_names.js';

const kKept = 'lk-emu-lang';

function wanted() {
  const asked = new URLSearchParams(location.search).get('lang');
  return asked ?? localStorage.getItem(kKept) ?? (document.documentElement.dataset.lang || navigator.language);
}

export const language = wanted().toLowerCase().startsWith('zh') ? 'zh' : 'en';
const words = language === 'zh' ? kChinese : kEnglish;
const names = language === 'zh' ? {...kChineseNames, ...kChineseFaults} : {};

/// t('lost_frames', {n: 3}): what {n} stands for is put in its place.
export function t(key, values = {}) {
  return (words[key] ?? kEnglish[key] ?? key).replace(/\{(\w+)\}/g, (all, name) => values[name] ?? all);
}

/// What the program calls something, in words: name('errors', 'under_voltage'). English is the name itself.
export const name = (group, key) => names[group]?.[key] ?? key.replaceAll('_', ' ');

/// A sentence that comes from the program, in this language where it is known.
export const about = (group, key, english) => names[group]?.[key] ?? english;

/// A fault by the name that it was given: of its kind, perhaps with a number, unless somebody thought of another one.
export function faultName(given, kind) {
  const number = given.startsWith(kind) ? /^(-\d+)?$/.exec(given.slice(kind.length)) : null;
  return number ? name('fault_names', kind) + number[0] : given;
}

/// What an object says in both languages: said(advice, 'what') of `what` and `what_zh`.
export const said = (object, key) => (language === 'zh' && object[`${key}_zh`]) || object[key] || '';

/// The page in the other language; where it stands is kept.
export function switchLanguage() {
  const other = language === 'zh' ? 'en' : 'zh';
  localStorage.setItem(kKept, other);
  const address = new URL(location.href);
  address.searchParams.delete('lang');
  if (address.href === location.href) location.reload();
  else location.replace(address);
}

/// Elements of index.html say which words are theirs.
export function translatePage() {
  document.documentElement.lang = language === 'zh' ? 'zh-CN' : 'en';
  for (const node of document.querySelectorAll('[data-t]')) node.textContent = t(node.dataset.t);
  for (const node of document.querySelectorAll('[data-t-label]')) {
    node.setAttribute('aria-label', t(node.dataset.tLabel));
    if (node.title) node.title = t(node.dataset.tLabel);
  }
}
