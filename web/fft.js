// Amplitude spectrum of samples: radix-2 Fourier transform with a Hann window.

const kPadding = 2;  // zero padding factor, so that the largest line is near the peak of the continuous spectrum
const kMaxTables = 4;

const tables = new Map();  // by size: cosines and sines of half a turn

function tableOf(size) {
  let table = tables.get(size);
  if (table) return table;
  if (tables.size >= kMaxTables) tables.clear();
  const half = size / 2;
  table = {cos: new Float64Array(half), sin: new Float64Array(half)};
  for (let n = 0; n < half; ++n) {
    table.cos[n] = Math.cos(2 * Math.PI * n / size);
    table.sin[n] = Math.sin(2 * Math.PI * n / size);
  }
  tables.set(size, table);
  return table;
}

function reverseBits(re, im) {
  for (let n = 1, other = 0; n < re.length; ++n) {
    let bit = re.length >> 1;
    for (; other & bit; bit >>= 1) other ^= bit;
    other ^= bit;
    if (n < other) {
      [re[n], re[other]] = [re[other], re[n]];
      [im[n], im[other]] = [im[other], im[n]];
    }
  }
}

/// Transforms in place: Σ x[n]·e^(−2πi·k·n/size). Pre: the size is a power of two.
export function fft(re, im) {
  const size = re.length;
  const {cos, sin} = tableOf(size);
  reverseBits(re, im);
  for (let half = 1; half < size; half *= 2) {
    const stride = size / (2 * half);
    for (let k = 0; k < half; ++k) {
      const c = cos[k * stride];
      const s = sin[k * stride];
      for (let a = k; a < size; a += 2 * half) {
        const b = a + half;
        const x = re[b] * c + im[b] * s;
        const y = im[b] * c - re[b] * s;
        re[b] = re[a] - x;
        im[b] = im[a] - y;
        re[a] += x;
        im[a] += y;
      }
    }
  }
}

/// Returns the amplitudes of `values` in their unit at frequencies n·step_Hz, without their mean. A sine of amplitude 1
/// has a line of 1. Null: fewer than 8 values.
export function spectrum(values, rate_Hz) {
  const count = values.length;
  if (count < 8) return null;
  const size = 2 ** Math.ceil(Math.log2(kPadding * count));
  const re = new Float64Array(size);
  const im = new Float64Array(size);
  let mean = 0;
  for (let n = 0; n < count; ++n) mean += values[n] / count;
  let weight = 0;
  for (let n = 0; n < count; ++n) {
    const hann = 0.5 - 0.5 * Math.cos(2 * Math.PI * (n + 0.5) / count);
    weight += hann;
    re[n] = (values[n] - mean) * hann;
  }
  fft(re, im);
  const lines = new Float64Array(size / 2);
  for (let n = 0; n < lines.length; ++n) lines[n] = 2 * Math.hypot(re[n], im[n]) / weight;
  return {step_Hz: rate_Hz / size, lines};
}

/// Returns {frequency_Hz, amplitude} of the highest line, interpolated by a parabola through the logarithms of three
/// lines. Null: the spectrum is flat.
export function peakOf({step_Hz, lines}) {
  let at = 1;
  for (let n = 2; n < lines.length - 1; ++n) if (lines[n] > lines[at]) at = n;
  if (!(lines[at] > 1e-12)) return null;
  const [a, b, c] = [lines[at - 1], lines[at], lines[at + 1]].map((line) => Math.log(Math.max(line, 1e-300)));
  const bend = a - 2 * b + c;
  const shift = bend < 0 ? Math.max(-0.5, Math.min(0.5, (a - c) / (2 * bend))) : 0;
  return {frequency_Hz: (at + shift) * step_Hz, amplitude: Math.exp(b - (a - c) * shift / 4)};
}

/// Returns the highest line in each of `columns` between two frequencies; interpolates where lines are sparser.
export function columnsOf({step_Hz, lines}, from_Hz, to_Hz, columns) {
  const out = new Float64Array(columns);
  for (let n = 0; n < columns; ++n) {
    const begin = (from_Hz + (to_Hz - from_Hz) * n / columns) / step_Hz;
    const end = (from_Hz + (to_Hz - from_Hz) * (n + 1) / columns) / step_Hz;
    const first = Math.ceil(begin);
    if (first < end) {
      for (let line = first; line < end && line < lines.length; ++line) out[n] = Math.max(out[n], lines[line]);
    } else {
      const low = Math.floor((begin + end) / 2);
      const share = (begin + end) / 2 - low;
      out[n] = (lines[low] ?? 0) * (1 - share) + (lines[low + 1] ?? 0) * share;
    }
  }
  return out;
}
