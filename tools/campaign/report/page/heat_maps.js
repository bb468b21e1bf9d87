// Counts on coloured ground: fault × outcome, the space with its holes, and what has moved since last time.

function countCell(of, outcome, showCases) {
  const count = of.outcomes[outcome];
  const style = tint(kColours[outcome], of.cases ? count / of.cases : 0);
  if (count === 0) return num('·', {style, class: 'num zero'});
  if (!kFailures.has(outcome)) return num(counted(count), {style});
  const label = t('show_cases', {fault: faultWord(of.kind), outcome: t(outcome), n: count});
  return num(el('button', {type: 'button', class: 'count', 'aria-label': label, title: label, text: counted(count),
    onclick: () => showCases(of.kind, outcome)}), {style});
}

function matrixRow(of, showCases) {
  return el('tr', {class: of.kind ? '' : 'all', 'data-kind': of.kind}, rowHead(faultWord(of.kind)), num(counted(of.cases)),
    ...answer.outcomes.map((outcome) => countCell(of, outcome, showCases)), num(shareText(of.coverage.share)));
}

function matrixPanel(showCases) {
  const table = el('table', {class: 'heat', id: 'matrix-table'},
    el('thead', {}, el('tr', {}, head(t('fault')), head(t('cases'), {class: 'num'}),
      ...answer.outcomes.map((outcome) => head(t(outcome), {class: 'num'})), head(t('share'), {class: 'num'}))),
    el('tbody', {}, ...answer.kinds.map((of) => matrixRow(of, showCases)), matrixRow(answer.all, showCases)));
  return panel('matrix', said(t('matrix_about')), broad(t('matrix'), table));
}

/// [cases, failures] by kind, state and command.
function spaceCells() {
  const cells = new Map();
  for (const [kind, state, command, cases, failures] of answer.space.met) cells.set(`${kind} ${state} ${command}`, [cases, failures]);
  return cells;
}

function spaceCell(found, most, where) {
  if (!found) return el('td', {class: 'hole', title: `${where}: ${t('hole')}`}, el('span', {class: 'sr', text: t('hole')}));
  const [cases, failures] = found;
  const style = failures ? tint('bad', failures / cases) : tint('accent', cases / most);
  return num(counted(cases), {style, title: `${where}: ${t('cell_about', {n: counted(cases), failures: counted(failures)})}`});
}

function spaceTable(onlyHoles) {
  const {kinds, states, commands} = answer.space;
  const cells = spaceCells();
  const most = Math.max(1, ...[...cells.values()].map(([cases]) => cases));
  const columns = states.flatMap((state, s) => commands.map((command, c) => [s, c]));
  const rows = kinds.map((kind, k) => [kind, columns.map(([s, c]) => cells.get(`${k} ${s} ${c}`))])
    .filter(([, found]) => !onlyHoles || found.includes(undefined));
  const begins = (c) => (c === 0 ? ' begins' : '');
  return el('table', {class: 'heat space', id: 'space-table'},
    el('thead', {},
      el('tr', {}, el('td', {}), ...states.map((state) => el('th', {scope: 'colgroup', colspan: String(commands.length), class: 'begins', text: wordOf(state)}))),
      el('tr', {}, head(t('fault')), ...columns.map(([, c]) => head(wordOf(commands[c]), {class: `num${begins(c)}`})))),
    el('tbody', {}, ...rows.map(([kind, found]) => el('tr', {}, rowHead(faultWord(kind)),
      ...found.map((one, n) => {
        const [s, c] = columns[n];
        const cell = spaceCell(one, most, `${faultWord(kind)}, ${wordOf(states[s])}, ${wordOf(commands[c])}`);
        cell.className += begins(c);
        return cell;
      })))));
}

function spacePanel() {
  const {combinations, holes} = answer.space;
  const place = el('div');
  const only = el('input', {type: 'checkbox', id: 'only-holes'});
  const show = () => place.replaceChildren(broad(t('space'), spaceTable(only.checked)));
  only.addEventListener('change', show);
  show();
  return panel('space', said(t('space_about')),
    el('p', {class: 'row'}, t('space_met', {n: counted(combinations - holes), all: counted(combinations), holes: counted(holes)}),
      el('label', {}, only, ` ${t('only_holes')}`)), place);
}

/// Above the diagonal it has become worse.
function moveColour(from, to) {
  if (from === to || from === 0 || to === 0) return 'dim';
  return to > from ? 'bad' : 'good';
}

function movesTable({moves}) {
  const rowSum = (row) => Math.max(1, row.reduce((sum, n) => sum + n, 0));
  return el('table', {class: 'heat', id: 'moves-table'},
    el('thead', {}, el('tr', {}, el('td', {}), ...answer.outcomes.map((outcome) => head(t(outcome), {class: 'num'})))),
    el('tbody', {}, ...moves.map((row, from) => el('tr', {}, rowHead(t(answer.outcomes[from])),
      ...row.map((count, to) => num(count ? counted(count) : '·',
        {style: tint(moveColour(from, to), count / rowSum(row)), class: count ? 'num' : 'num zero'}))))));
}
