// What all sections are made of.

const answer = JSON.parse(byId('answer').textContent);

const counted = (n) => n.toLocaleString('en-US');
/// So many significant figures, as people read them.
const figures = (value, places = 4) => (value === null || value === undefined ? '–' : String(Number(value.toPrecision(places))));
/// A share, whose last figures count where it is near to 1.
const shareText = (share) => (share === null ? '–' : share.toFixed(4));

/// What is a failure, and the colour of each outcome.
const kFailures = new Set(['late', 'silently_wrong', 'hang', 'crash']);
const kColours = {not_fired: 'dim', no_effect: 'zero', tolerated: 'zero', detected_by_drive: 'good', detected_by_host: 'good',
  late: 'warn', silently_wrong: 'bad', hang: 'bad', crash: 'bad'};

/// A colour's tint for a share of 0 to 1: text stays readable on it.
function tint(colour, share) {
  const percent = share > 0 ? Math.round(8 + 34 * Math.sqrt(share)) : 0;
  return `background: color-mix(in srgb, var(--${colour}) ${percent}%, transparent)`;
}

/// A section with its heading, which the navigation leads to.
function panel(name, ...content) {
  return el('section', {class: 'panel', id: name, 'aria-label': t(name)}, el('h2', {text: t(name)}), ...content);
}

const said = (text) => el('p', {class: 'dim about', text});

/// A table that scrolls by itself where it is too broad. Whoever has no mouse scrolls it by keys.
function broad(label, table) {
  return el('div', {class: 'broad', tabindex: '0', role: 'region', 'aria-label': label}, table);
}

const num = (text, attributes = {}) => el('td', {class: 'num', ...attributes}, text);
/// What is too long for its place is told by the title.
const rowHead = (text) => el('th', {scope: 'row', title: text, text});
const head = (text, attributes = {}) => el('th', {scope: 'col', ...attributes}, text);

function outcomeChip(outcome) {
  const colour = kColours[outcome];
  return el('span', {class: `chip ${colour === 'dim' || colour === 'zero' ? '' : colour}`, text: t(outcome)});
}

/// Where values are on a strip: 0 to 100.
class LogScale {
  constructor(low, high) {
    this.low = Math.floor(Math.log10(low));
    this.high = Math.max(Math.ceil(Math.log10(high)), this.low + 1);
  }

  at(value) {
    const place = (Math.log10(Math.max(value, 1e-12)) - this.low) / (this.high - this.low);
    return 100 * Math.min(1, Math.max(0, place));
  }

  decades() {
    return Array.from({length: this.high - this.low + 1}, (_, n) => 10 ** (this.low + n));
  }
}

/// A drawing as broad as its cell; x is 0 to 100, y is 0 to 20 from the top.
function strip(label, ...shapes) {
  return svg('svg', {class: 'strip', viewBox: '0 0 100 20', preserveAspectRatio: 'none', role: 'img', 'aria-label': label}, ...shapes);
}
const upright = (x, name) => svg('path', {class: name, d: `M${x} 0V20`});
const bar = (x, width, height, name) => svg('rect', {class: name, x, width: Math.max(0.3, width), y: 20 - height, height});

/// The scale above strips.
function ticks(places) {
  return el('div', {class: 'ticks', 'aria-hidden': 'true'},
    ...places.map(([at, text]) => el('span', {style: `left: ${at}%`, class: at < 3 ? 'first' : at > 97 ? 'last' : '', text})));
}

async function copyText(text) {
  try {
    await navigator.clipboard.writeText(text);
    note(t('copied'));
  } catch {
    note(t('not_copied'), true);
  }
}

/// A command, to be copied.
function command(text) {
  return el('span', {class: 'command'}, el('code', {class: 'mono', text}),
    el('button', {type: 'button', class: 'quiet', onclick: () => copyText(text), text: t('copy')}));
}
