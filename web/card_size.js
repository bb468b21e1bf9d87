// Size of the cards of the bus view: the largest at which all cards fit on the screen.

const kFew = 12;      // drives that never become dense
const kFewAside = 4;  // as kFew, next to a robot, which takes half of the screen
const kMax = 3;       // assumed: larger cards show nothing more
const kStep = 0.05;

/// Returns the size of a card at size 1 in pixels, including the gap to the next.
function roomOf(groups) {
  const style = getComputedStyle(groups);
  const gap = parseFloat(style.getPropertyValue('--gap'));
  return {width: parseFloat(style.getPropertyValue('--least')) + gap, height: groups.querySelector('.card').offsetHeight + gap, gap};
}

const columnsAt = ({width, gap}, size, box) => Math.max(1, Math.floor((box.width / size + gap) / width));
const countOf = (group) => group.querySelectorAll('.card').length;

/// Returns the number of columns up to `most` that leaves the fewest empty places in the same rows.
function evenColumns(groups, most) {
  return Math.max(...[...groups.children].map((group) => Math.ceil(countOf(group) / Math.ceil(countOf(group) / most)) || 1));
}

function fits(groups, room, size, box) {
  const columns = columnsAt(room, size, box);
  let high = 0;
  for (const group of groups.children) {
    const head = group.querySelector('header');
    high += head.offsetHeight + Math.ceil(countOf(group) / columns) * room.height * size;
  }
  return high <= box.height;
}

/// Sets the largest size at which all cards are visible, at least 1.
function fit(groups) {
  const main = groups.closest('main');
  if (!groups.isConnected || groups.closest('[hidden]') || !groups.querySelector('.card')) return;
  const box = {width: groups.clientWidth, height: main.clientHeight - (groups.getBoundingClientRect().top - main.getBoundingClientRect().top) - main.scrollTop - 12};
  const count = countOf(groups);
  groups.style.setProperty('--size', 1);
  groups.classList.remove('dense');
  if (count > (groups.closest('.with-robot') ? kFewAside : kFew) && !fits(groups, roomOf(groups), 1, box)) groups.classList.add('dense');
  const room = roomOf(groups);
  let size = kMax;
  while (size > 1 && !fits(groups, room, size, box)) size -= kStep;
  size = Math.max(1, size);
  groups.style.setProperty('--size', size.toFixed(2));
  groups.style.setProperty('--columns', evenColumns(groups, columnsAt(room, size, box)));
}

let watched = null;
const watcher = new ResizeObserver(() => watched && fit(watched));

/// Fits the cards now and after each change of the window.
export function fitCards(groups) {
  if (watched !== groups) {
    watcher.disconnect();
    watched = groups;
    watcher.observe(groups.closest('main'));
  }
  fit(groups);
}
