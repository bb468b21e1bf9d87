// Figures: the overview, coverage with its intervals, latencies, the smallest cases and the plan.

function tile(name, value, about, colour = '') {
  return el('div', {class: `tile ${colour}`}, el('dt', {text: name}), el('dd', {text: value}), about ? el('dd', {class: 'about', text: about}) : null);
}

function coverageTile({coverage}) {
  const about = coverage.dangerous ? t('detected_in_time', {n: counted(coverage.covered), all: counted(coverage.dangerous)}) : t('no_danger');
  const bounds = coverage.interval ? `${t('interval')} ${coverage.interval.map(shareText).join(' – ')}` : '';
  return tile(t('coverage'), shareText(coverage.share), bounds ? `${about}; ${bounds}` : about, 'coverage');
}

function tiles() {
  const {all, campaign, space} = answer;
  const failures = [...kFailures].reduce((sum, outcome) => sum + all.outcomes[outcome], 0);
  return el('dl', {class: 'tiles'},
    coverageTile(all),
    tile(t('cases'), counted(all.cases), t('cases_of', {n: counted(all.cases), all: counted(campaign.cases)})),
    tile(t('failures'), counted(failures), t('failures_about'), failures ? 'bad' : 'good'),
    ...[...kFailures].map((outcome) => tile(t(outcome), counted(all.outcomes[outcome]), '', all.outcomes[outcome] ? kColours[outcome] : '')),
    tile(t('not_fired'), counted(all.outcomes.not_fired), ''),
    space && tile(t('space'), `${counted(space.combinations - space.holes)} / ${counted(space.combinations)}`,
      t('space_met', {n: counted(space.combinations - space.holes), all: counted(space.combinations), holes: counted(space.holes)})),
    answer.comparison ? tile(t('comparison'), t('cases_worse', {n: counted(answer.comparison.worse)}), '', answer.comparison.worse ? 'bad' : 'good') : null);
}

function requirements() {
  if (!answer.required.length) return said(t('required_none'));
  return el('ul', {class: 'required'}, ...answer.required.map((one) => el('li', {},
    el('span', {class: `chip ${one.holds ? 'good' : 'bad'}`, text: t(one.holds ? 'holds' : 'fails')}), ' ',
    el('code', {class: 'mono', text: one.text}), ' ',
    el('span', {class: 'dim', text: one.measured === null ? t('nothing_measured') : t('measured', {value: figures(one.measured, 6)})}),
    one.missing ? el('span', {class: 'dim', text: ` ${t('but_missing', {n: counted(one.missing)})}`}) : null)));
}

function overviewPanel() {
  const {campaign} = answer;
  const facts = [t('version', {version: campaign.version}), t('sampled', {sampling: campaign.sampling})];
  if (Number.isSafeInteger(campaign.seed)) facts.push(t('seed_is', {seed: campaign.seed}));
  if (campaign.tolerant_time_s !== null) facts.push(t('tolerant_time', {time: figures(campaign.tolerant_time_s)}));
  if (answer.real_time) facts.push(t('real_time', {n: counted(answer.real_time), flipped: counted(answer.flipped)}));
  return panel('overview', el('p', {class: 'sentence', text: campaign.about}), said(facts.join(' · ')), tiles(),
    el('h3', {text: t('required')}), requirements());
}

function needText(need) {
  if (need.met) return t('met');
  if (need.at_this_share === null) return t('not_at_this_share', {n: counted(need.all_detected)});
  const same = need.at_this_share === need.all_detected;
  return t(same ? 'needs' : 'needs_share', {n: counted(need.all_detected), more: counted(need.at_this_share)});
}

function coverageStrip({share, interval}) {
  const shapes = [];
  if (interval) shapes.push(bar(100 * interval[0], 100 * (interval[1] - interval[0]), 20, 'range'));
  if (share !== null) shapes.push(upright(100 * share, 'mark'));
  return strip(share === null ? '–' : shareText(share), ...shapes);
}

function coverageRow(of) {
  const {coverage} = of;
  return el('tr', {class: of.kind ? '' : 'all'}, rowHead(faultWord(of.kind)),
    num(`${counted(coverage.covered)} / ${counted(coverage.dangerous)}`, {class: 'num still'}), num(shareText(coverage.share)),
    el('td', {class: 'drawn'}, coverageStrip(coverage)),
    coverage.interval ? num(coverage.interval.map(shareText).join(' – '), {class: 'num still'}) : null,
    ...coverage.needs.map((need) => el('td', {text: needText(need)})));
}

function coveragePanel() {
  const {coverage} = answer.all;
  const {sampling} = answer.campaign;
  const places = [[0, '0'], [25, '0.25'], [50, '0.5'], [75, '0.75'], [100, '1']];
  const rows = answer.kinds.filter((of) => of.coverage.dangerous > 0);
  const table = el('table', {id: 'coverage-table'}, el('thead', {}, el('tr', {}, head(t('fault')), head(t('detected_of'), {class: 'num'}),
    head(t('share'), {class: 'num'}), head(ticks(places), {class: 'drawn', 'aria-label': t('share')}), coverage.interval ? head(t('interval'), {class: 'num'}) : null,
    ...coverage.needs.map((need) => head(t('to_claim', {claim: figures(100 * need.claim)}))))),
  el('tbody', {}, ...rows.map(coverageRow), coverageRow(answer.all)));
  return panel('coverage', said(t('coverage_about')),
    coverage.interval ? said(t('interval_about')) : el('p', {class: 'about warn', text: t('no_claim', {sampling})}), broad(t('coverage'), table));
}

function latencyRow(of, who, scale, tolerant_s) {
  const figuresOf = of.latency[who];
  const most = Math.max(1, ...figuresOf.bins.map(([, count]) => count));
  const shapes = figuresOf.bins.map(([upTo_s, count]) => {
    const from = scale.at(upTo_s / 10 ** (1 / 8));
    return bar(from, scale.at(upTo_s) - from, 2 + 16 * count / most, 'bin');
  });
  if (tolerant_s) shapes.push(upright(scale.at(tolerant_s), 'limit'));
  shapes.push(upright(scale.at(figuresOf.p50_s), 'mark'), upright(scale.at(figuresOf.p99_s), 'mark p99'));
  const label = `p50 ${figures(figuresOf.p50_s)} s, p99 ${figures(figuresOf.p99_s)} s, ${t('worst')} ${figures(figuresOf.worst_s)} s`;
  return el('tr', {class: of.kind ? '' : 'all'}, rowHead(faultWord(of.kind)), num(counted(figuresOf.cases)),
    el('td', {class: 'drawn'}, strip(label, ...shapes)), num(figures(figuresOf.p50_s)), num(figures(figuresOf.p99_s)), num(figures(figuresOf.worst_s)));
}

function latencyTable(who) {
  const rows = [...answer.kinds, answer.all].filter((of) => of.latency[who].cases > 0);
  if (!rows.length) return said(t('none_detected'));
  const tolerant_s = answer.campaign.tolerant_time_s;
  const ends = rows.flatMap((of) => of.latency[who].bins.map(([upTo_s]) => upTo_s)).concat(tolerant_s || []);
  const scale = new LogScale(Math.min(...ends) / 2, Math.max(...ends));
  const places = scale.decades().map((value) => [scale.at(value), value >= 0.999 ? `${figures(value)} s` : value > 0.9e-3 ? `${figures(value * 1e3)} ms` : `${figures(value * 1e6)} µs`]);
  return broad(t('latency'), el('table', {id: 'latency-table'}, el('thead', {}, el('tr', {}, head(t('fault')), head(t('cases'), {class: 'num'}),
    head(ticks(places), {class: 'drawn wide', 'aria-label': t('latency')}), head('p50 s', {class: 'num'}), head('p99 s', {class: 'num'}), head(`${t('worst')} s`, {class: 'num'}))),
  el('tbody', {}, ...rows.map((of) => latencyRow(of, who, scale, tolerant_s)))));
}

function latencyPanel() {
  const place = el('div');
  const buttons = ['first', 'drive', 'host'].map((who) => el('button', {type: 'button', 'data-who': who, text: t(`who_${who}`), onclick: () => show(who)}));
  const show = (who) => {
    for (const button of buttons) button.setAttribute('aria-pressed', String(button.dataset.who === who));
    place.replaceChildren(latencyTable(who));
  };
  show('first');
  const {all, campaign} = answer;
  const about = [t('latency_about')];
  if (campaign.tolerant_time_s) about.push(t('tolerant_line', {time: figures(campaign.tolerant_time_s)}));
  if (all.latency.first.rounded) about.push(t('rounded'));
  return panel('latency', said(about.join(' ')), el('div', {class: 'row', role: 'group', 'aria-label': t('who')}, ...buttons), place);
}

function smallestCard(one) {
  const [number] = one.case;
  // As an image a picture can do nothing but be seen.
  const picture = one.svg ? el('img', {src: `data:image/svg+xml;charset=utf-8,${encodeURIComponent(one.svg)}`, alt: t('picture_of', {n: number}), loading: 'lazy'}) : null;
  return el('article', {class: 'smallest'}, el('h3', {}, `${faultWord(one.kind)} `, outcomeChip(one.outcome)),
    caseFacts(one.case, one.command), picture);
}

function smallestPanel() {
  return panel('smallest', said(t('smallest_about')), el('div', {class: 'cards'}, ...answer.smallest.map(smallestCard)));
}

function planPanel() {
  return panel('plan', el('p', {class: 'about dim mono', text: answer.campaign.input_hash}),
    el('pre', {class: 'mono', tabindex: '0', text: answer.campaign.plan}));
}
