// Columns of a picture: of each the least and the largest sample, so that no peak is lost. What was worked out for the
// last picture is kept; a moving picture needs but a few new columns.

export class Bins {
  constructor(samples, columns) {
    this.samples = samples;
    this.columns = columns;
    this.restart(0, 0);
  }

  restart(width_s, first) {
    this.width_s = width_s;
    this.first = first;  // bins stand still on the axis of time, or a moving picture would shimmer: n·width_s
    this.next = first;
    this.complete = first;  // the first that may still change
    this.times = [];     // two places for each bin
    this.values = this.columns.map(() => []);
  }

  /// [times, values…] of some `count` bins; null where there is no sample.
  view(from_s, to_s, count) {
    const width_s = Number(((to_s - from_s) / count).toPrecision(9));
    const first = Math.floor(from_s / width_s);
    const last = Math.floor(to_s / width_s);
    if (width_s !== this.width_s || first < this.first || first >= this.next) this.restart(width_s, first);
    // The newest were not complete; of a bus that is behind the others, or where the picture goes past now, many are not.
    const from = Math.max(first, Math.min(this.complete, last));
    for (const list of [this.times, ...this.values]) {
      list.length = 2 * (from - this.first);
      list.splice(0, 2 * (first - this.first));
    }
    this.first = first;
    this.next = from;
    this.add(last);
    this.complete = Math.min(this.next, Math.floor(this.samples.last_s / width_s));
    return [this.times, ...this.values];
  }

  add(last) {
    const {samples, width_s} = this;
    let begin = samples.find(this.next * width_s);
    for (; this.next <= last; ++this.next) {
      const end = samples.find((this.next + 1) * width_s);
      this.times.push((this.next + 0.25) * width_s, (this.next + 0.75) * width_s);
      this.columns.forEach((column, n) => pushExtremes(this.values[n], samples.values[column], begin, end));
      begin = end;
    }
  }
}

const orNull = (value) => (value === undefined || Number.isNaN(value) ? null : value);

/// Both extremes, in the order in which they came.
function pushExtremes(list, values, begin, end) {
  let least = begin;
  let most = begin;
  for (let n = begin + 1; n < end; ++n) {
    if (values[n] < values[least] || Number.isNaN(values[least])) least = n;
    if (values[n] > values[most] || Number.isNaN(values[most])) most = n;
  }
  if (begin === end) list.push(null, null);
  else list.push(orNull(values[Math.min(least, most)]), orNull(values[Math.max(least, most)]));
}
