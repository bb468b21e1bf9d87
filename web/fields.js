// Reads numbers from input fields.

import {note} from './dom.js';
import {t} from './words.js';

/// Returns one number per field; null, with a note to the user, if one is empty or invalid.
export function numbersOf(...inputs) {
  const wrong = inputs.find((input) => input.value === '' || !input.checkValidity());
  if (!wrong) return inputs.map((input) => Number(input.value));
  const name = wrong.getAttribute('aria-label') ?? wrong.labels[0]?.textContent.trim() ?? '';
  const range = wrong.min !== '' && wrong.max !== '' ? ` (${t('from_to', {min: wrong.min, max: wrong.max})})` : '';
  note(t('needs_number', {name}) + range, true);
  wrong.focus();
  return null;
}
