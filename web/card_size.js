// Size of the cards of the bus view: the largest at which all cards fit on the screen. Rows have no empty places.

const kFew = 12;      // drives that become dense only if all then fit on the screen
const kMax = 3;       // assumed: larger cards show nothing more
const kStep = 0.05;
const kTallest = 1.6;  // assumed: a card higher than this, relative to its text, looks empty
const kSmaller = 0.8;  // assumed: rows of equal length are worth cards smaller by this
const kMargin_px = 12;

const cardsOf = (group) => [...group.querySelectorAll('.card')];

/// Returns the least size of a card in pixels, including the gap to the next.
function roomOf(groups) {
  const style = getComputedStyle(groups);
  const gap = parseFloat(style.getPropertyValue('--gap'));
  groups.classList.add('measured');
  const height = Math.max(...cardsOf(groups).map((card) => card.offsetHeight)) + gap;
  groups.classList.remove('measured');
  return {width: parseFloat(style.getPropertyValue('--least')) + gap, height, gap};
}

const columnsAt = ({width, gap}, size, box) => Math.max(1, Math.floor((box.width / size + gap) / width));
const rowsOf = (group, columns) => Math.ceil(cardsOf(group).length / columns);
const rowsOfAll = (groups, columns) => [...groups.children].reduce((sum, group) => sum + rowsOf(group, columns), 0);

function fits(groups, room, size, box) {
  return rowsOfAll(groups, columnsAt(room, size, box)) * room.height * size <= box.height;
}

/// Returns whether all rows of each group have equal numbers of cards.
const isEven = (groups, columns) => [...groups.children].every((group) => cardsOf(group).length % rowsOf(group, columns) === 0);

/// Distributes the cards of a group evenly to its rows, each of which is filled.
function arrange(group, columns) {
  const cards = cardsOf(group);
  const rows = rowsOf(group, columns);
  const start = (row) => Math.ceil(row * cards.length / rows);
  cards.forEach((card, n) => {
    const row = Math.floor(n * rows / cards.length);
    card.style.setProperty('--in-row', start(row + 1) - start(row));
  });
}

/// Sets the largest size at which all cards are visible, at least 1.
function fit(groups) {
  const main = groups.closest('main');
  if (!groups.isConnected || groups.closest('[hidden]') || !groups.querySelector('.card')) return;
  groups.style.setProperty('--size', 1);
  groups.classList.remove('dense');
  const head = [...groups.children].reduce((sum, group) => sum + group.offsetHeight - group.querySelector('.cards').offsetHeight, 0);
  const top = groups.getBoundingClientRect().top - main.getBoundingClientRect().top + main.scrollTop;
  const box = {width: groups.clientWidth, height: main.clientHeight - top - head - (groups.children.length - 1) * kMargin_px - kMargin_px};
  if (!fits(groups, roomOf(groups), 1, box)) {
    groups.classList.add('dense');
    if (cardsOf(groups).length <= kFew && !fits(groups, roomOf(groups), 1, box)) groups.classList.remove('dense');
  }
  const room = roomOf(groups);
  const smaller = (from, holds) => {
    let size = from;
    while (size > 1 && !holds(size)) size = Math.max(1, size - kStep);
    return size;
  };
  const largest = smaller(kMax, (size) => fits(groups, room, size, box));
  const even = smaller(largest, (size) => isEven(groups, columnsAt(room, size, box)));
  const size = even >= kSmaller * largest ? even : largest;
  const columns = columnsAt(room, size, box);
  for (const group of groups.children) arrange(group, columns);
  const row = Math.min(kTallest * room.height, box.height / rowsOfAll(groups, columns) / size) - room.gap / size;
  groups.style.setProperty('--size', size.toFixed(2));
  groups.style.setProperty('--row', `${Math.floor(row)}px`);
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
