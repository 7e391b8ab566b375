// @ts-check
/** Two inspections of a pond beside each other. Here the page is put together. */

import { Problem, getSession } from '../api/client.js';
import { compareSessions, getRods } from '../api/ponds.js';
import { CompareOptions, MODES } from '../state/comparison.js';
import { isRunning } from '../state/robots.js';
import { ChangeDetail } from './changedetail.js';
import { ChangeList } from './changelist.js';
import { CompareHead } from './comparehead.js';
import { CompareMap } from './comparemap.js';
import { CompareTable } from './comparetable.js';
import { CompareToolbar } from './comparetoolbar.js';
import { h } from './dom.js';
import { helpDialog } from './help.js';
import { listen } from './keys.js';
import { navigation } from './nav.js';
import { toggleTheme } from './theme.js';
import { TopBar } from './topbar.js';

/** @typedef {import('../state/comparison.js').SideName} SideName */

const BLINK_MS = 900;
const LOOK_AGAIN_MS = 3000;
const LAST = 'last';

export class ComparePage {
  #bar = new TopBar([navigation()]);
  #news = h('p', { class: 'banner-line', id: 'news', role: 'status', hidden: true });
  #fault = h('div', { class: 'note bad', role: 'alert', id: 'fault', hidden: true });
  /** @type {number | undefined} */ #blinking;
  /** @type {CompareAnswer | null} */ answer = null;
  /** When the maps had all their tiles and the comparison stood there, ms since the page was asked for. @type {number | null} */ completeAt = null;

  /** @param {string} search */
  constructor(search) {
    this.options = new CompareOptions().read(search);
    this.head = new CompareHead((side, session) => this.#reload({ [side]: session }), () => this.#swap());
    this.map = new CompareMap(this.options);
    this.list = new ChangeList(this.options, (id) => this.choose(id, true));
    this.detail = new ChangeDetail();
    this.table = new CompareTable((id) => { this.#showTable(false); this.choose(id, true); }, () => this.#showTable(false));
    const actions = this.#actions();
    this.help = helpDialog(actions);
    this.toolbar = new CompareToolbar(this.options, { auto: () => this.#blink(), table: () => this.#showTable(true), help: () => this.help.showModal() });
    this.map.element.append(this.table.element, this.#news);
    const column = h('div', { class: 'map-column' }, this.head.element, this.toolbar.element, this.#fault, this.map.element);
    const side = h('aside', { class: 'side', 'aria-label': 'What changed', tabindex: '0' }, this.detail.element, this.list.element);
    this.element = h('div', {}, this.#bar.element, h('main', { class: 'compare' }, column, side), this.help);
    this.#bar.title = 'Compare two inspections';
    listen(actions);
    this.#listen();
  }

  /** For tests and benches, read only. */
  get figures() {
    const page = this;
    return { get completeAt() { return page.completeAt; }, get mode() { return page.options.mode; }, get front() { return page.options.front; }, get waiting() { return page.map.waiting; } };
  }

  #listen() {
    this.options.addEventListener('change', () => this.#update());
    this.map.addEventListener('painted', () => this.#complete());
    this.map.addEventListener('choose', (event) => this.choose(/** @type {CustomEvent} */ (event).detail));
    this.detail.addEventListener('close', () => this.choose(null));
    this.detail.addEventListener('previous', () => this.#step(-1));
    this.detail.addEventListener('next', () => this.#step(1));
  }

  async start() {
    const { options } = this;
    for (const side of /** @type {SideName[]} */ (['base', 'with'])) if (!options[side]) this.head.show(side, null);
    if (!options.with || !options.base) return this.#half();
    await this.#tell(async () => {
      const answer = compareSessions(options.base, options.with);
      if (options.base === LAST) options.set({ base: (await answer).base.session }); // who is asked later sees the same two
      const [base, later] = await Promise.all([getSession(options.base), getSession(options.with)]);
      this.#bar.title = `${base.name} → ${later.name}`;
      this.head.show('base', base);
      this.head.show('with', later);
      this.map.open(base, later);
      this.#show(await answer);
      this.#watch([base, later]);
      await this.head.offer(later.pond?.id); // after what was asked for
    });
  }

  /** One of the two, or none, is known: the other is chosen. */
  async #half() {
    const known = /** @type {SideName[]} */ (['base', 'with']).filter((side) => this.options[side]);
    await this.#tell(async () => {
      const facts = await Promise.all(known.map((side) => getSession(this.options[side])));
      known.forEach((side, i) => this.head.show(side, facts[i]));
      await this.head.offer(facts[0]?.pond?.id);
    });
    this.#say('Choose the two inspections that are to be compared.');
  }

  /** @param {CompareAnswer} answer */
  #show(answer) {
    this.answer = answer;
    if (!answer.comparable) this.toolbar.refuse();
    if (!answer.comparable && this.options.mode === 'difference') this.options.set({ mode: 'side' });
    this.list.show(answer);
    this.#update();
    if (this.options.rod && !this.options.place) this.map.goTo(this.options.rod, true);
    this.#complete();
  }

  #update() {
    const { options, answer } = this;
    history.replaceState(null, '', options.address);
    this.list.update();
    this.map.marked = this.list.rods;
    this.map.update();
    this.table.update(this.list.rods);
    if (options.mode !== 'blink' && this.#blinking) this.#blink();
    if (options.shown.rods) void this.#loadRods();
    if (answer) this.detail.show(options.rod, this.#changeOf(options.rod), answer);
  }

  /** @param {string | null} id */
  #changeOf(id) { return [...this.answer?.rods ?? [], ...this.answer?.not_comparable ?? []].find((rod) => rod.rod_id === id); }

  /** @param {string | null} id @param {boolean} [go] */
  choose(id, go = false) {
    this.options.set({ rod: id });
    if (id && go) this.map.goTo(id, true);
  }

  /** @param {number} by along the list */
  #step(by) {
    const { rods } = this.list;
    if (!rods.length) return;
    const at = rods.findIndex((rod) => rod.rod_id === this.options.rod);
    this.choose(rods[at < 0 ? (by > 0 ? 0 : rods.length - 1) : (at + by + rods.length) % rods.length].rod_id, true);
  }

  async #loadRods() {
    const { sides } = this.map;
    if (!sides) return;
    for (const side of [sides.base, sides.with]) {
      if (side.rows) continue;
      side.rows = new Map();
      await this.#tell(async () => { side.rows = new Map((await getRods(side.facts.id)).map((row) => [row.rod_id, row])); });
    }
    this.map.repaint();
  }

  #blink() {
    clearInterval(this.#blinking);
    this.#blinking = this.#blinking ? undefined : setInterval(() => this.options.flip(), BLINK_MS);
    this.toolbar.blinking(Boolean(this.#blinking));
    if (this.#blinking) this.options.set({ mode: 'blink' });
  }

  /** @param {boolean} open */
  #showTable(open) {
    this.table.toggle(open, this.list.rods);
    if (!open) document.getElementById('table-button')?.focus();
  }

  #swap() { this.#reload({ base: this.options.with, with: this.options.base }); }

  /** The same view of others. @param {Partial<Record<SideName, string>>} pair */
  #reload(pair) {
    location.assign(Object.assign(this.options, pair).address);
  }

  /** Say so where one that runs has gone on; what is shown stays as it is until it is asked for. @param {SessionFacts[]} shown */
  #watch(shown) {
    const running = shown.filter(({ state }) => isRunning(state));
    if (!running.length) return;
    setInterval(() => void this.#tell(async () => {
      for (const facts of running) {
        const now = await getSession(facts.id);
        if (now.revision > facts.revision) this.#say(`${facts.name} has gone on: revision ${now.revision}, and this page shows ${facts.revision}. `, h('a', { href: this.options.address, text: 'Compare again' }));
      }
    }), LOOK_AGAIN_MS);
  }

  /** @param {...(string | Node)} words */
  #say(...words) {
    this.#news.hidden = false;
    this.#news.replaceChildren(...words);
  }

  #complete() {
    if (!this.completeAt && this.answer && this.map.whole) this.completeAt = performance.now();
  }

  /** @param {() => Promise<void>} run */
  async #tell(run) {
    try {
      await run();
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      this.#fault.hidden = false;
      this.#fault.replaceChildren(h('p', { text: error.message }), h('p', {}, h('a', { href: '/?inspections', text: 'All inspections' })));
    }
  }

  /** @returns {import('./help.js').Action[]} */
  #actions() {
    const { options } = this;
    const modes = MODES.map((mode, i) => ({ keys: [String(i + 1)], word: `Show: ${MODE_NAMES[mode]}`, run: () => { if (mode !== 'difference' || this.answer?.comparable) options.set({ mode }); } }));
    return [
      { keys: ['x', ' '], word: 'Before or after, alone', run: () => options.flip() }, ...modes,
      { keys: ['b'], word: 'Blink by itself, or stop', run: () => this.#blink() },
      { keys: ['['], word: 'Divider or opacity back', run: () => options.slide(-1) }, { keys: [']'], word: 'Divider or opacity on', run: () => options.slide(1) },
      { keys: ['n'], word: 'Next rod of the list', run: () => this.#step(1) }, { keys: ['p'], word: 'Rod before it', run: () => this.#step(-1) },
      { keys: ['m'], word: 'Marks on the rods', run: () => options.toggle('changes') }, { keys: ['r'], word: 'Rods: what they read as', run: () => options.toggle('rods') },
      { keys: ['g'], word: 'Grid of metres', run: () => options.toggle('grid') }, { keys: ['d'], word: 'Table', run: () => this.#showTable(Boolean(this.table.element.hidden)) },
      { keys: ['e'], word: 'Export as CSV', run: () => this.list.export() }, { keys: ['s'], word: 'Swap before and after', run: () => this.#swap() },
      { keys: ['+', '='], word: 'Closer', run: () => this.map.view?.zoom(1.5) }, { keys: ['-'], word: 'Farther', run: () => this.map.view?.zoom(1 / 1.5) },
      { keys: ['0', 'f'], word: 'The whole pond', run: () => this.map.view?.fit() }, { keys: ['t'], word: 'Light or dark', run: toggleTheme },
      { keys: ['i'], word: 'All inspections', run: () => location.assign('/?inspections') }, { keys: ['?'], word: 'These keys', run: () => this.help.showModal() },
      { keys: ['Escape'], word: 'Close the table or the rod', run: () => (this.table.element.hidden ? this.choose(null) : this.#showTable(false)) },
    ];
  }
}

const MODE_NAMES = { side: 'side by side', swipe: 'swipe', blink: 'one of the two', opacity: 'one over the other', difference: 'difference' };
