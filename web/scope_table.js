// Table in the scope's drawer: value of each trace now, at the cursors, and between them.

import {el, setText} from './dom.js';
import {figures} from './format.js';
import {t} from './words.js';

const kFew = 16;

export class ScopeTable {
  /// `onToggle` is called with a trace to hide or show.
  constructor(onToggle) {
    this.onToggle = onToggle;
    this.body = el('tbody');
    this.span = el('caption', {text: ' '});
    const heads = [t('trace'), t('now'), 'A', 'B', 'B − A', t('least'), t('most')];
    this.root = el('div', {class: 'values'}, el('table', {}, this.span,
      el('thead', {}, el('tr', {}, ...heads.map((head, n) => el('th', {text: head, scope: 'col', class: n ? 'num' : ''})))), this.body));
    this.rows = [];
  }

  set(traces) {
    this.rows = traces.map((trace) => {
      const cells = Array.from({length: 6}, () => el('td', {class: 'num', text: '–'}));
      const swatch = el('span', {class: `swatch${trace.dash ? ' dashed' : ''}`});
      swatch.style.borderColor = trace.colour;
      const button = el('button', {type: 'button', title: t('legend_about'), onclick: () => this.onToggle(trace)}, swatch, trace.label);
      return {trace, cells, button, root: el('tr', {'data-trace': trace.label}, el('th', {scope: 'row'}, button), ...cells)};
    });
    this.body.replaceChildren(...this.rows.map((row) => row.root));
    this.showHidden();
  }

  showHidden() {
    for (const {trace, button} of this.rows) button.setAttribute('aria-pressed', trace.shown);
  }

  /// Returns the visible rows; updating a hundred rows would be slow.
  seen() {
    if (this.rows.length <= kFew) return this.rows;
    const height = this.rowHeight ||= this.rows[0].root.offsetHeight || 24;
    const first = Math.max(0, Math.floor(this.root.scrollTop / height) - 2);
    return this.rows.slice(first, first + Math.ceil(this.root.clientHeight / height) + 4);
  }

  showCursors(yes) {
    if (this.root.classList.contains('with-cursors') === yes) return;
    this.root.classList.toggle('with-cursors', yes);
    this.rowHeight = 0;  // rows then have two lines
  }

  show({from_s, to_s}, {A, B}, held) {
    const between = A !== null && B !== null;
    this.showCursors(A !== null || B !== null);
    const [from, to] = between ? [Math.min(A, B), Math.max(A, B)] : [from_s, to_s];
    setText(this.span, between
      ? t('between', {ms: figures((B - A) * 1000), hz: figures(1 / Math.abs(B - A), 4)})
      : held ? t('in_view_held') : t('in_view', {s: figures(to_s - from_s, 3)}));
    for (const {trace, cells} of this.seen()) {
      const {samples} = trace.capture;
      const at = (time_s) => (time_s === null ? null : samples.at(trace.column, time_s));
      const a = at(A);
      const b = at(B);
      const extremes = samples.extremes(trace.column, from, to);
      const now = [at(samples.last_s), a, b, a !== null && b !== null ? b - a : null, extremes?.min, extremes?.max];
      now.forEach((value, n) => setText(cells[n], figures(value, 5)));
    }
  }
}
