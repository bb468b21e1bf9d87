// Selects the view. The address, #view?key=value, has its state, so that users can save, send and reload it.

import './header.js';
import * as bus from './bus.js';
import * as bench from './bench.js';
import * as scope from './scope.js';
import * as traffic from './traffic.js';
import {byId} from './dom.js';
import {follow, store, on} from './store.js';
import {switchLanguage, t, translatePage} from './words.js';

const views = {bus, scope, traffic, bench};
let current = null;
let handled = null;   // the address that was handled or written last

/// Writes the state of the view to the address, unless the user has just changed that.
function keepAddress() {
  if (!store.status || location.hash !== handled) return;
  const parts = Object.entries(views[current].state()).filter(([, value]) => value !== '' && value !== null && value.length !== 0);
  const query = new URLSearchParams(parts).toString().replaceAll('%2F', '/').replaceAll('%3A', ':').replaceAll('%2C', ',');
  const address = `#${current}${query && '?'}${query}`;
  if (address === location.hash) return;
  history.replaceState(null, '', address);
  handled = location.hash;
}

function go() {
  const [name, query] = location.hash.slice(1).split('?');
  const chosen = Object.hasOwn(views, name) ? name : 'bus';
  if (current !== chosen) {
    for (const [key, view] of Object.entries(views)) {
      byId(`view-${key}`).hidden = key !== chosen;
      if (key === current) view.show(false);
    }
    for (const link of document.querySelectorAll('nav a')) {
      if (link.hash === `#${chosen}`) link.setAttribute('aria-current', 'page');
      else link.removeAttribute('aria-current');
    }
    // Users act on the bench and look at the scope and the traffic afterwards; the bus view needs neither.
    scope.listen(chosen !== 'bus');
    traffic.listen(chosen !== 'bus');
    current = chosen;
    views[chosen].show(true);
  }
  document.title = `${t(chosen)} – lk-emu`;
  if (!store.status) return;
  history.replaceState(null, '', `#${chosen}`);  // first, so that a failing address is not tried again
  handled = location.hash;
  if (query) views[chosen].visit(new URLSearchParams(query));
  keepAddress();
}

translatePage();
byId('language').addEventListener('click', switchLanguage);
// The target of the skip link is not a view, so the browser must not follow it.
document.querySelector('.skip').addEventListener('click', (event) => {
  event.preventDefault();
  byId('main').focus();
});
addEventListener('hashchange', go);
addEventListener('pagehide', keepAddress);
document.addEventListener('pointerup', () => setTimeout(keepAddress));
on('program', go);
on('change', keepAddress);
go();
follow();
