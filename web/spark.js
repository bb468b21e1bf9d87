// A small curve of the last five seconds of a value, in real time.

import {svg} from './dom.js';

const kSpan_ms = 5000;

export class Spark {
  /// `least` is the smallest range of values that fills the height.
  constructor(least) {
    this.least = least;
    this.points = [];
    this.line = svg('polyline');
    this.root = svg('svg', {class: 'spark', viewBox: '0 -1 100 22', preserveAspectRatio: 'none', 'aria-hidden': 'true'}, this.line);
  }

  /// Adds a value; NaN clears the curve.
  add(at_ms, value) {
    if (!Number.isFinite(value)) this.points = [];
    else this.points.push([at_ms, value]);
    while (this.points.length && this.points[0][0] < at_ms - kSpan_ms) this.points.shift();
    const values = this.points.map(([, one]) => one);
    const [low, high] = [Math.min(...values), Math.max(...values)];
    const span = Math.max(this.least, high - low);
    const place = ([at, one]) => `${(100 - 100 * (at_ms - at) / kSpan_ms).toFixed(1)},${(10 - 20 * (one - (low + high) / 2) / span).toFixed(1)}`;
    this.line.setAttribute('points', this.points.map(place).join(' '));
  }
}
