// Selects the view. Addresses are #view?key=value, so that users can save and send them.

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
    current = chosen;
    views[chosen].show(true);
  }
  document.title = `${t(chosen)} – lk-emu`;
  if (query && store.status) {
    history.replaceState(null, '', `#${chosen}`);  // first, so that a failing address is not tried again
    views[chosen].visit?.(new URLSearchParams(query));
  }
}

translatePage();
byId('language').addEventListener('click', switchLanguage);
// The target of the skip link is not a view, so the browser must not follow it.
document.querySelector('.skip').addEventListener('click', (event) => {
  event.preventDefault();
  byId('main').focus();
});
addEventListener('hashchange', go);
on('program', go);
go();
follow();
