// How large the cards of the bus are: as large as the screen has room for, so that few fill it and many fit.

const kFew = 12;      // drives that are never made dense
const kFewAside = 4;  // the same beside a robot, which takes half of the screen
const kMost = 3;      // assumed: larger ones say no more
const kStep = 0.05;

/// In pixels, of one card as it is at size 1, with the gap to the next.
function roomOf(groups) {
  const style = getComputedStyle(groups);
  const gap = parseFloat(style.getPropertyValue('--gap'));
  return {width: parseFloat(style.getPropertyValue('--least')) + gap, height: groups.querySelector('.card').offsetHeight + gap, gap};
}

const columnsAt = ({width, gap}, size, box) => Math.max(1, Math.floor((box.width / size + gap) / width));
const countOf = (group) => group.querySelectorAll('.card').length;

/// As many columns as leave the fewest places empty in so many rows or fewer.
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

/// The largest size at which all of them are seen; 1 where there is none.
function fit(groups) {
  const main = groups.closest('main');
  if (!groups.isConnected || groups.closest('[hidden]') || !groups.querySelector('.card')) return;
  const box = {width: groups.clientWidth, height: main.clientHeight - (groups.getBoundingClientRect().top - main.getBoundingClientRect().top) - main.scrollTop - 12};
  const count = countOf(groups);
  groups.style.setProperty('--size', 1);
  groups.classList.remove('dense');
  if (count > (groups.closest('.with-robot') ? kFewAside : kFew) && !fits(groups, roomOf(groups), 1, box)) groups.classList.add('dense');
  const room = roomOf(groups);
  let size = kMost;
  while (size > 1 && !fits(groups, room, size, box)) size -= kStep;
  size = Math.max(1, size);
  groups.style.setProperty('--size', size.toFixed(2));
  groups.style.setProperty('--columns', evenColumns(groups, columnsAt(room, size, box)));
}

let watched = null;
const watcher = new ResizeObserver(() => watched && fit(watched));

/// Now, and whenever the window changes.
export function fitCards(groups) {
  if (watched !== groups) {
    watcher.disconnect();
    watched = groups;
    watcher.observe(groups.closest('main'));
  }
  fit(groups);
}
