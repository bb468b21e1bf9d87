// Samples of chosen signals in a fixed amount of memory; the oldest are dropped first.

import {Bins} from './bins.js';

const kBudget_bytes = 96 * 1024 * 1024;
const kMax = 2_000_000;
const kMaxPictures = 16;

export class Samples {
  constructor(columns) {
    this.columns = columns;
    this.capacity = Math.min(kMax, Math.floor(kBudget_bytes / 8 / 2 / (columns + 1)));
    // Twice the capacity, so that the samples are always contiguous: at the end of the array they move to its front.
    this.times = new Float64Array(2 * this.capacity);
    this.values = Array.from({length: columns}, () => new Float64Array(2 * this.capacity));
    this.begin = 0;
    this.end = 0;
    this.keepFrom = Infinity;  // while a past instant is displayed: samples from here on are kept
    this.received = 0;         // total count
    this.bins = new Map();     // by number of columns: Bins of one plot
  }

  get length() {
    return this.end - this.begin;
  }
  get first_s() {
    return this.length ? this.times[this.begin] : NaN;
  }
  get last_s() {
    return this.length ? this.times[this.end - 1] : NaN;
  }

  /// Appends a row with a value for each column, null where missing.
  push(time_s, row) {
    if (this.length && time_s <= this.last_s) return;
    if (this.length === this.capacity) {
      if (this.first_s >= this.keepFrom) return;
      ++this.begin;
    }
    if (this.end === this.times.length) this.moveToFront();
    this.times[this.end] = time_s;
    for (let n = 0; n < this.columns; ++n) this.values[n][this.end] = row[n] ?? NaN;
    ++this.end;
    ++this.received;
  }

  /// Copies samples of another Samples, as many as fit; `places[n]` is its column for column n here, -1: none.
  adopt(other, places) {
    this.keepFrom = other.keepFrom;
    const newest = Math.max(other.begin, other.end - this.capacity);
    const begin = Math.min(newest, other.find(this.keepFrom));
    const end = Math.min(other.end, begin + this.capacity);
    this.end = end - begin;
    this.times.set(other.times.subarray(begin, end));
    places.forEach((place, n) => {
      if (place < 0) this.values[n].fill(NaN, 0, this.end);
      else this.values[n].set(other.values[place].subarray(begin, end));
    });
  }

  moveToFront() {
    this.times.copyWithin(0, this.begin, this.end);
    for (const column of this.values) column.copyWithin(0, this.begin, this.end);
    this.end -= this.begin;
    this.begin = 0;
  }

  /// Returns the first index with a time of at least `time_s`. O(log n).
  find(time_s) {
    let low = this.begin;
    let high = this.end;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.times[middle] < time_s) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /// Returns the value of the last sample up to `time_s`, or null.
  at(column, time_s) {
    const place = this.find(time_s + 1e-9) - 1;
    return place >= this.begin ? this.values[column][place] : null;
  }

  /// Returns {min, max} between two times; null without samples.
  extremes(column, from_s, to_s) {
    const values = this.values[column];
    let min = Infinity;
    let max = -Infinity;
    const last = this.find(to_s + 1e-9);
    for (let n = this.find(from_s); n < last; ++n) {
      const value = values[n];
      if (value < min) min = value;
      if (value > max) max = value;
    }
    return min <= max ? {min, max} : null;
  }

  /// Returns [times, values…] for a plot of `bins` columns. With more samples than that, each bin has its least and its
  /// largest value, so that no peak is lost.
  view(from_s, to_s, bins, columns) {
    const first = Math.max(this.begin, this.find(from_s) - 1);
    const last = Math.min(this.end, this.find(to_s) + 1);
    if (last - first <= 2 * bins) {
      return [this.times.subarray(first, last), ...columns.map((n) => this.values[n].subarray(first, last))];
    }
    const key = columns.join();
    if (!this.bins.has(key)) {
      if (this.bins.size >= kMaxPictures) this.bins.clear();
      this.bins.set(key, new Bins(this, columns));
    }
    return this.bins.get(key).view(from_s, to_s, bins);
  }
}
