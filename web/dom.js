// Short helpers to make elements.

function apply(node, attributes) {
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith('aria-')) {
      if (value !== undefined) node.setAttribute(key, value);
      continue;
    }
    if (value === undefined || value === null || value === false) continue;
    if (key.startsWith('on')) node.addEventListener(key.slice(2), value);
    else if (key === 'text') node.textContent = value;
    else if (key === 'value') node.value = value;
    else if (key === 'checked') node.checked = value;
    else node.setAttribute(key, value === true ? '' : value);
  }
}

/// Example: el('button', {class: 'main', onclick: f}, 'Go')
export function el(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  apply(node, attributes);
  node.append(...children.flat().filter((child) => child !== null && child !== undefined));
  return node;
}

export function svg(tag, attributes = {}, ...children) {
  const node = document.createElementNS('http://www.w3.org/2000/svg', tag);
  apply(node, attributes);
  node.append(...children);
  return node;
}

export const byId = (id) => document.getElementById(id);

/// Writes only changed text, to avoid a new layout.
export function setText(node, text) {
  if (node.firstChild?.nodeValue !== text) node.textContent = text;
}

const noteTimers = new WeakMap();

/// Shows a short message in the corner. Errors stay longer; a repeated message is shown once.
export function note(text, bad = false) {
  const kind = bad ? 'note bad' : 'note';
  const there = [...byId('notes').children].find((one) => one.textContent === text && one.className === kind);
  const node = there ?? el('div', {class: kind, text});
  if (!there) byId('notes').append(node);
  clearTimeout(noteTimers.get(node));
  noteTimers.set(node, setTimeout(() => node.remove(), bad ? 9000 : 3500));
}

/// Returns a control with a label.
export const labelled = (text, control) => el('label', {}, `${text} `, control);
