// Cases in a table that is searched and sorted; a page of it is drawn at a time.

const kRows = 50;
const kColumn = Object.fromEntries(answer.residual.columns.map((name, n) => [name, n]));

/// Of a case, as answer.residual.columns has them.
const of = (row, name) => row[kColumn[name]];

/// The first that noticed, since the first effect; null: nobody did.
function latencyOf(row) {
  const times = ['drive_s', 'host_s'].map((name) => of(row, name)).filter((time) => time !== null);
  const effect_s = of(row, 'first_effect_s');
  return times.length && effect_s !== null ? Math.min(...times) - effect_s : null;
}

function valuesOf(row) {
  const values = of(row, 'values');
  return answer.campaign.dimensions.map(({name}, n) => [name, values[n] ?? null]).filter(([, value]) => value !== null);
}

/// All that is known of a case.
function caseFacts(row, again) {
  const seconds = (name) => (of(row, name) === null ? null : `${figures(of(row, name), 9)} s`);
  const margin = of(row, 'margin');
  const facts = [
    ['number', String(of(row, 'number'))],
    ['values', valuesOf(row).map(([name, value]) => `${name}=${value}`).join(', ')],
    ['fault_at', seconds('fault_at_s')], ['effect_at', seconds('first_effect_s')],
    ['by_drive_at', seconds('drive_s')], ['by_host_at', seconds('host_s')],
    ['violated_at', seconds('violated_s')], ['violated', of(row, 'violated')],
    ['margin', margin === null ? null : figures(margin)],
    ['met_in', of(row, 'state') && t('state_and_command', {state: wordOf(of(row, 'state')), command: wordOf(of(row, 'command'))})],
    ['note', of(row, 'note')],
    ['runs', of(row, 'real_time') ? t('runs_about', {n: of(row, 'runs'), flips: of(row, 'flips')}) : null],
  ];
  return el('dl', {class: 'facts'}, ...facts.filter(([, text]) => text).flatMap(([name, text]) => [el('dt', {text: t(name).replace(/[,，] ?s$/, '')}), el('dd', {text})]),
    el('dt', {text: t('again')}), el('dd', {}, command(again)));
}

/// A case that is listed: what is sorted by, and what is searched in.
class Listed {
  constructor(row, before = null) {
    this.row = row;
    this.before = before;
    this.language = '';
  }

  key(column) {
    if (column === 'before') return answer.outcomes.indexOf(this.before);
    if (column === 'outcome') return answer.outcomes.indexOf(of(this.row, 'outcome'));
    if (column === 'detected_after') return latencyOf(this.row);
    return of(this.row, {effect_at: 'first_effect_s', violated_at: 'violated_s', fault: 'kind'}[column] ?? column);
  }

  text() {
    if (this.language !== language) {
      this.language = language;
      this.words = [of(this.row, 'number'), faultWord(of(this.row, 'kind')), t(of(this.row, 'outcome')), this.before ? t(this.before) : '',
        of(this.row, 'violated'), wordOf(of(this.row, 'state')), wordOf(of(this.row, 'command')), of(this.row, 'note'),
        ...valuesOf(this.row).map(([name, value]) => `${name}=${value}`)].join('\n').toLowerCase();
    }
    return this.words;
  }
}

/// What has no value comes last, whichever way it is sorted; the same are in the order of their numbers.
function compareKeys(a, b, way) {
  if (a === b) return 0;
  if (a === null) return 1;
  if (b === null) return -1;
  return a < b ? -way : way;
}

class CaseTable {
  constructor(id, listed, columns) {
    this.id = id;
    this.listed = listed;
    this.columns = columns;
    this.sort = {column: 'number', way: 1};
    this.filter = {words: '', kind: '', outcome: ''};
    this.first = 0;
    this.open = new Set();
  }

  /// In the language of the page; what was chosen stays.
  build() {
    this.body = el('tbody');
    this.status = el('span', {class: 'dim', role: 'status', 'aria-live': 'polite'});
    this.back = el('button', {type: 'button', text: t('earlier'), onclick: () => this.turn(-1)});
    this.on = el('button', {type: 'button', text: t('later'), onclick: () => this.turn(1)});
    this.heads = this.columns.map((column) => this.head(column));
    this.search = el('input', {type: 'search', value: this.filter.words, 'aria-label': t('search'), placeholder: t('search'), oninput: () => this.narrow({words: this.search.value})});
    this.kind = this.choice('kind', 'every_fault', [...new Set(this.listed.map(({row}) => of(row, 'kind')))].sort(), faultWord);
    const outcomes = new Set(this.listed.map(({row}) => of(row, 'outcome')));
    this.outcome = this.choice('outcome', 'every_outcome', answer.outcomes.filter((one) => outcomes.has(one)), t);
    const table = el('table', {class: 'cases'}, el('thead', {}, el('tr', {}, ...this.heads)), this.body);
    this.root = el('div', {id: this.id}, el('div', {class: 'row'}, this.search, this.kind, this.outcome, this.back, this.on, this.status), broad(t('number'), table));
    this.refresh();
    return this.root;
  }

  choice(name, every, words, say) {
    const select = el('select', {'aria-label': t(every), onchange: () => this.narrow({[name]: select.value})},
      el('option', {value: '', text: t(every)}), ...words.map((word) => el('option', {value: word, text: say(word)})));
    select.value = this.filter[name];
    return select;
  }

  head(column) {
    const numeric = !['fault', 'outcome', 'before', 'violated'].includes(column);
    return el('th', {scope: 'col', class: numeric ? 'num' : '', 'data-column': column},
      el('button', {type: 'button', class: 'quiet', title: t('sort_by', {column: t(column)}), onclick: () => this.sortBy(column), text: t(column)}));
  }

  sortBy(column) {
    const way = this.sort.column === column ? -this.sort.way : 1;
    this.sort = {column, way};
    this.first = 0;
    this.refresh();
  }

  narrow(filter) {
    Object.assign(this.filter, filter);
    this.first = 0;
    this.refresh();
  }

  /// From elsewhere on the page.
  showOnly(kind, outcome) {
    this.search.value = '';
    this.kind.value = kind;
    this.outcome.value = outcome;
    this.narrow({words: '', kind, outcome});
    this.root.scrollIntoView({block: 'start'});
    this.search.focus({preventScroll: true});
  }

  turn(way) {
    this.first += way * kRows;
    this.draw();
  }

  fits(one) {
    const {kind, outcome} = this.filter;
    if (kind && of(one.row, 'kind') !== kind) return false;
    if (outcome && of(one.row, 'outcome') !== outcome) return false;
    return this.words.every((word) => one.text().includes(word));
  }

  refresh() {
    this.words = this.filter.words.toLowerCase().split(/\s+/).filter(Boolean);
    const {column, way} = this.sort;
    const keyed = this.listed.filter((one) => this.fits(one)).map((one) => [one.key(column), one]);
    keyed.sort(([a, x], [b, y]) => compareKeys(a, b, way) || of(x.row, 'number') - of(y.row, 'number'));
    this.chosen = keyed.map(([, one]) => one);
    for (const th of this.heads) {
      if (th.dataset.column === column) th.setAttribute('aria-sort', way > 0 ? 'ascending' : 'descending');
      else th.removeAttribute('aria-sort');
    }
    this.draw();
  }

  draw() {
    const shown = this.chosen.slice(this.first, this.first + kRows);
    this.body.replaceChildren(...shown.flatMap((one) => this.rows(one)));
    this.back.disabled = this.first === 0;
    this.on.disabled = this.first + kRows >= this.chosen.length;
    setText(this.status, shown.length ? t('shown', {from: counted(this.first + 1), to: counted(this.first + shown.length), all: counted(this.chosen.length)}) : t('shown_none'));
  }

  rows(one) {
    const number = of(one.row, 'number');
    const open = this.open.has(number);
    const button = el('button', {type: 'button', class: 'quiet', 'aria-expanded': String(open), 'aria-label': t('details', {n: number}),
      onclick: () => this.toggle(number), text: `${open ? '▾' : '▸'} ${number}`});
    const row = el('tr', {'data-number': String(number)}, ...this.columns.map((column) => (column === 'number' ? num(button) : this.cell(one, column))));
    const details = open ? el('tr', {class: 'details'}, el('td', {colspan: String(this.columns.length)}, caseFacts(one.row, answer.case_command + number))) : null;
    return details ? [row, details] : [row];
  }

  cell(one, column) {
    if (column === 'fault') return el('td', {text: faultWord(of(one.row, 'kind'))});
    if (column === 'outcome') return el('td', {}, outcomeChip(of(one.row, 'outcome')));
    if (column === 'before') return el('td', {}, outcomeChip(one.before));
    if (column === 'violated') return el('td', {class: 'long', text: of(one.row, 'violated') || of(one.row, 'note')});
    return num(figures(one.key(column), 5));
  }

  toggle(number) {
    if (!this.open.delete(number)) this.open.add(number);
    this.draw();
    this.body.querySelector(`[data-number="${number}"] button`).focus();
  }
}
