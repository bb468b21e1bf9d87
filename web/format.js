// Formats numbers and words. Widths stay constant while values change.

import {t} from './words.js';

const kMinus = '\u2212';

/// Returns 12.3, −0.50; a dash for no value.
export function fixed(value, digits) {
  if (value === null || value === undefined || !Number.isFinite(value)) return '–';
  const text = value.toFixed(digits);
  if (Number(text) === 0) return (0).toFixed(digits);
  return text.replace('-', kMinus);
}

/// As fixed(), in at most eight characters: with fewer digits, or as −1.2e+9.
export function fitted(value, digits) {
  for (let n = digits; n >= 0; --n) {
    const text = fixed(value, n);
    if (text.length <= 8) return text;
  }
  return value.toExponential(1).replace('-', kMinus);
}

/// Returns six significant figures by default.
export function figures(value, count = 6) {
  if (value === null || value === undefined || !Number.isFinite(value)) return '–';
  return String(Number(value.toPrecision(count))).replace('-', kMinus);
}

/// Formats simulated time: 3:25:45.123
export function clockText(time_s) {
  const whole = Math.floor(time_s);
  const two = (n) => String(n).padStart(2, '0');
  const rest = fixed(time_s - whole, 3).slice(1);
  const minutes = Math.floor(whole / 60);
  const head = minutes >= 60 ? `${Math.floor(minutes / 60)}:${two(minutes % 60)}` : `${minutes}`;
  return `${head}:${two(whole % 60)}${rest === '.000' && time_s - whole > 0.5 ? '.999' : rest}`;
}

/// Returns the unit of a signal by its name, for its axis.
export function unitOf(signal) {
  const tail = signal.slice(signal.lastIndexOf('_') + 1);
  if (['deg', 'dps', 'A', 'V', 'C', 'Nm'].includes(tail)) return tail;
  if (signal.startsWith('duty')) return 'duty';
  if (signal === 'encoder') return 'counts';
  if (signal === 'power') return 'power';
  return 'state';
}

/// Returns the name of an axis for a unit: "speed, °/s".
export const axisName = (unit) => t(`axis_${unit}`);
