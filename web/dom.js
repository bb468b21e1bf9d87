// Making elements, in few words.

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

/// el('button', {class: 'main', onclick: f}, 'Go')
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

/// Writes only what has changed: the browser then lays nothing out anew.
export function setText(node, text) {
  if (node.firstChild?.nodeValue !== text) node.textContent = text;
}

/// A short message in the corner. What went wrong stays longer.
export function note(text, bad = false) {
  const node = el('div', {class: bad ? 'note bad' : 'note', text});
  byId('notes').append(node);
  setTimeout(() => node.remove(), bad ? 9000 : 3500);
}

/// A labelled control.
export const labelled = (text, control) => el('label', {}, `${text} `, control);
