// Legend of a plot of the scope: names of the value axis and of lines, values below the pointer; a click hides a line.

import {el, setText} from './dom.js';
import {figures} from './format.js';
import {t} from './words.js';

const kMax = 12;  // more would cover the plot; the table below has all

export class PlotLegend {
  constructor(holder, name, traces, {onToggle, onAuto}) {
    this.rows = traces.slice(0, kMax).map((trace) => {
      const value = el('span', {class: 'value'});
      const swatch = el('span', {class: `swatch${trace.dash ? ' dashed' : ''}`});
      swatch.style.borderColor = trace.colour;
      const button = el('button', {type: 'button', title: t('legend_about'), onclick: () => onToggle(trace)}, swatch, trace.label, value);
      return {trace, value, button};
    });
    this.auto = el('button', {type: 'button', hidden: true, title: t('auto_values_about'), onclick: onAuto}, t('auto_values'));
    this.root = el('div', {class: 'plot-legend'}, el('span', {class: 'axis-name', text: name}), this.auto, ...this.rows.map((row) => row.button),
      traces.length > kMax ? el('span', {class: 'dim', text: t('legend_more', {n: traces.length - kMax})}) : '');
    holder.append(this.root);
    this.showHidden();
  }

  showHidden() {
    for (const {trace, button} of this.rows) button.setAttribute('aria-pressed', trace.shown);
  }

  /// Shows the values at an instant; null hides them. `byHand`: the value axis is not automatic.
  show(time_s, byHand) {
    this.auto.hidden = !byHand;
    this.root.classList.toggle('with-values', time_s !== null);
    for (const {trace, value} of this.rows) {
      setText(value, time_s === null ? '' : figures(trace.capture.samples.at(trace.column, time_s), 5));
    }
  }
}
