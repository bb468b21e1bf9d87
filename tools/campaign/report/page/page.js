// The page: its sections, its language and its colours.

const kColumns = ['number', 'fault', 'outcome', 'effect_at', 'detected_after', 'violated_at', 'margin', 'violated'];
const residual = new CaseTable('residual-cases', answer.residual.rows.map((row) => new Listed(row)), kColumns);
const worse = answer.comparison
  ? new CaseTable('worse-cases', answer.comparison.cases.map((one) => new Listed(one.case, one.before)), kColumns.toSpliced(2, 0, 'before'))
  : null;

const leftOut = (n) => (n ? el('p', {class: 'about warn', text: t('left_out', {n: counted(n)})}) : null);

function residualPanel() {
  if (!answer.residual.rows.length) return panel('residual', said(t('no_residual')));
  return panel('residual', leftOut(answer.residual.left_out), residual.build());
}

function comparisonPanel() {
  const {comparison, campaign} = answer;
  const counts = ['worse', 'better', 'same'].map((name) => tile(t(name), counted(comparison[name]), '',
    comparison[name] ? {worse: 'bad', better: 'good'}[name] : ''));
  const changed = comparison.before.input_hash !== campaign.input_hash || comparison.before.version !== campaign.version;
  return panel('comparison', el('dl', {class: 'tiles'}, ...counts),
    changed ? said(t('changed', {version: comparison.before.version})) : null,
    comparison.only_before + comparison.only_now + comparison.not_fired
      ? said(t('not_compared', {before: counted(comparison.only_before), now: counted(comparison.only_now), not_fired: counted(comparison.not_fired)})) : null,
    said(t('moves_about')), broad(t('comparison'), movesTable(comparison)),
    ...(comparison.cases.length ? [el('h3', {text: t('worse_list')}), leftOut(comparison.left_out), worse.build()] : []));
}

function showCases(kind, outcome) {
  residual.showOnly(kind, outcome);
}

function render() {
  translatePage();
  const panels = [overviewPanel(), answer.comparison ? comparisonPanel() : null, matrixPanel(showCases), coveragePanel(), latencyPanel(),
    answer.space ? spacePanel() : null, answer.smallest.length ? smallestPanel() : null, residualPanel(), planPanel()].filter(Boolean);
  byId('main').replaceChildren(...panels);
  byId('places').replaceChildren(...panels.map(({id}) => el('a', {href: `#${id}`, text: t(id)})));
  setText(byId('name'), answer.campaign.name);
}

byId('language').addEventListener('click', () => {
  const {scrollTop} = byId('main');
  switchLanguage();
  render();
  byId('main').scrollTop = scrollTop;
});
document.querySelector('.skip').addEventListener('click', (event) => {
  event.preventDefault();
  byId('main').focus();
});

const kKeptTheme = 'lk-emu-theme';
const bright = matchMedia('(prefers-color-scheme: light)');
let theme = kept(kKeptTheme);
function applyTheme() {
  document.documentElement.dataset.theme = theme ?? (bright.matches ? 'light' : 'dark');
}
bright.addEventListener('change', applyTheme);
byId('theme').addEventListener('click', () => {
  theme = document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark';
  keep(kKeptTheme, theme);
  applyTheme();
});

applyTheme();
render();
