// @ts-check
/** Composition: reads the address, shows the list of inspections or one of them, and offers figures to tests. */

import { Problem, getSession, listSessions } from './api/client.js';
import { format as addressOf, parse } from './state/address.js';
import { isRunning } from './state/robots.js';
import { h } from './views/dom.js';
import { lostNote } from './views/lost.js';
import { restoreTheme } from './views/theme.js';

/** @typedef {import('./views/live.js').Live} Live */

/** @param {string} session @param {import('./state/address.js').Address} address */
async function showLive(session, address) {
  const [{ Live }, facts] = await Promise.all([import('./views/live.js'), getSession(session)]);
  const live = new Live(facts, address);
  document.body.replaceChildren(live.element);
  live.start();
  expose(live);
}

/**
 * Figures for tests and benches, read only.
 * revision: the last held in full. paintedAt(R): epoch ms at which R, or a later one with it, was drawn; null before.
 * rasterDigest(), rawDigest(), pastDigest(): SHA-256 of the mosaic's pixels (RGBA), hex; of the one made from raw poses;
 * of the one shown in review. state: what the page holds.
 * @param {Live} live
 */
function expose(live) {
  const figures = {
    get revision() { return live.inspection.revision; },
    get link() { return live.link.state; },
    get waiting() { return live.intake.waiting; },
    get dropped() { return live.intake.dropped; },
    get state() { return structuredClone({ facts: live.inspection.facts, rods: live.inspection.rods, poses: live.inspection.poses }); },
    paintedAt: (/** @type {number} */ revision) => live.view?.painted.at(revision) ?? null,
    rasterDigest: async () => (await live.view?.mosaic.digest()) ?? null,
    pastDigest: async () => (await live.view?.past?.raster.digest()) ?? null,
    rawDigest: async () => (await live.view?.raw?.raster.digest()) ?? null,
  };
  Object.defineProperty(globalThis, 'pondwatch', { value: Object.freeze(figures), configurable: true });
}

/** Pages by the word that their address begins with; each comes when it is asked for. @type {Record<string, () => Promise<{element: HTMLElement, start: () => unknown}>>} */
const PAGES = {
  compare: async () => exposed(new (await import('./views/comparepage.js')).ComparePage(location.search)),
  reconcile: async () => exposed(new (await import('./views/reconcilepage.js')).ReconcilePage(location.search)),
  ponds: async () => exposed(new (await import('./views/pondspage.js')).PondsPage()),
  pond: async () => exposed(new (await import('./views/pondpage.js')).PondPage(location.search)),
  methods: async () => exposed(new (await import('./views/methodspage.js')).MethodsPage(location.search)),
};

/** @template {{figures: object}} T @param {T} page */
function exposed(page) {
  Object.defineProperty(globalThis, 'pondwatch', { value: Object.freeze(page.figures), configurable: true });
  return page;
}

async function main() {
  restoreTheme();
  const asked = [...new URLSearchParams(location.search).keys()].find((word) => Object.hasOwn(PAGES, word));
  if (asked) {
    const page = await PAGES[asked]();
    document.body.replaceChildren(page.element, lostNote());
    return page.start();
  }
  const address = parse(location.search);
  const { session, home } = address;
  if (session) return showLive(session, address);
  const running = home ? undefined : (await listSessions()).find((facts) => isRunning(facts.state));
  if (running) {
    history.replaceState(null, '', addressOf({ ...address, session: running.id }));
    return showLive(running.id, address);
  }
  const { Home } = await import('./views/home.js');
  const list = new Home(!home);
  document.body.replaceChildren(list.element);
  list.start();
}

main().catch((error) => {
  const text = error instanceof Problem ? error.message : `The page failed: ${error}`;
  const again = h('p', {}, h('a', { href: location.href, text: 'Try again' }), ' · ', h('a', { href: '/?inspections', text: 'All inspections' }));
  document.body.replaceChildren(h('main', { class: 'page' }, h('div', { class: 'note bad', role: 'alert' }, h('p', { text }), again)));
});
