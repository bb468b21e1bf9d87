// Columns of a plot, each with its least and largest sample, so that no peak is lost. Bins of the previous plot are
// reused; a moving plot needs only a few new ones.

export class Bins {
  constructor(samples, columns) {
    this.samples = samples;
    this.columns = columns;
    this.restart(0, 0);
  }

  restart(width_s, first) {
    this.width_s = width_s;
    this.first = first;  // bins begin at n·width_s, fixed in time; otherwise a moving plot would flicker
    this.next = first;
    this.complete = first;  // first bin that may still change
    this.times = [];     // two entries per bin
    this.values = this.columns.map(() => []);
  }

  /// Returns [times, values…] of `count` bins; null without samples.
  view(from_s, to_s, count) {
    const width_s = Number(((to_s - from_s) / count).toPrecision(9));
    const first = Math.floor(from_s / width_s);
    const last = Math.floor(to_s / width_s);
    if (width_s !== this.width_s || first < this.first || first >= this.next) this.restart(width_s, first);
    // Recomputes incomplete bins: the newest, and more if this bus is behind others or the plot extends past now.
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

/// Appends both extremes in their order of time.
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
