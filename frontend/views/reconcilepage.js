// @ts-check
/** What is declared against what was observed, line by line, with the evidence of each line two clicks away. */

import { getSession } from '../api/client.js';
import { getPond, getRodHistory, reconcile, reconcileUrl } from '../api/ponds.js';
import { format as addressOf } from '../state/address.js';
import * as format from '../state/format.js';
import { OUTCOMES, ReconcileOptions, counted, outcomeOf, shown } from '../state/reconciliation.js';
import { isRunning } from '../state/robots.js';
import { wordOf } from '../state/rods.js';
import { evidenceOf } from './changedetail.js';
import { reading } from './changelist.js';
import { h, setText } from './dom.js';
import { helpDialog } from './help.js';
import { inventoryForm } from './inventoryform.js';
import { listen } from './keys.js';
import { navigation } from './nav.js';
import { Fault, tableOf } from './pagekit.js';
import { pastStrip } from './paststrip.js';
import { toggleTheme } from './theme.js';
import { TopBar } from './topbar.js';

const MOST_ROWS = 1000;
const HEADS = ['Item', 'Position', 'Declared', 'On', 'Observed', 'Outcome', 'Declared is right', 'Line'];

export class ReconcilePage {
  #bar = new TopBar([navigation()]);
  #fault = new Fault();
  #about = h('div', { class: 'pair-side' });
  #inventory = h('select', { id: 'inventory', 'aria-label': 'Declared inventory', onChange: () => this.options.set({ inventory: this.#inventory.value, line: null }) });
  #counts = h('div', { class: 'chips', role: 'group', 'aria-label': 'Which outcomes are listed' });
  #sum = h('p', { id: 'sum', role: 'status' });
  #rows = h('div', { id: 'lines' });
  #undeclared = h('details', { id: 'undeclared' });
  #detail = h('section', { id: 'line-panel', 'aria-label': 'Evidence' });
  #export = h('a', { id: 'export', text: 'Export CSV', title: 'Every line (E)', download: '', hidden: true });
  /** @type {PondFacts | null} */ #pond = null;
  /** @type {Reconciliation | null} */ answer = null;
  #asked = 0;
  #wanted = '';

  /** @param {string} search */
  constructor(search) {
    this.options = new ReconcileOptions().read(search);
    const actions = this.#actions();
    this.help = helpDialog(actions);
    const importer = inventoryForm(() => this.#pond?.id ?? '', (made) => { importer.removeAttribute('open'); void this.#imported(made); });
    const keys = h('button', { type: 'button', id: 'help-button', title: 'Keys (?)', 'aria-label': 'Keys', text: '?', onClick: () => this.help.showModal() });
    const head = h('div', { class: 'pair' }, this.#about, h('div', { class: 'pair-side after' }, h('span', { class: 'badge when', text: 'Declared' }), this.#inventory), keys);
    const body = h('div', { class: 'reconciled' }, this.#fault.element, importer, this.#sum, h('div', { class: 'list-tools' }, this.#counts, this.#export), this.#rows, this.#undeclared);
    this.#detail.append(h('p', { class: 'quiet', text: 'Choose a line to see what was observed at its position: N goes to the next.' }));
    this.element = h('div', {}, this.#bar.element, h('main', { class: 'compare' }, h('div', { class: 'map-column' }, head, body), h('aside', { class: 'side', 'aria-label': 'Evidence', tabindex: '0' }, this.#detail)), this.help);
    this.#bar.title = 'Reconcile with a declared inventory';
    this.options.addEventListener('change', () => void this.#update());
    listen(actions);
  }

  get figures() {
    const page = this;
    return { get total() { return page.answer?.total ?? null; } };
  }

  async start() {
    await this.#fault.tell(async () => {
      const facts = await getSession(this.options.session);
      const running = isRunning(facts.state);
      this.#about.replaceChildren(h('span', { class: 'badge when', text: 'Observed' }), h('a', { href: addressOf({ session: facts.id }), text: facts.name || facts.id }),
        h('span', { class: running ? 'badge running' : 'badge', text: running ? `RUNNING · as of revision ${facts.revision}` : facts.state }), h('span', { class: 'quiet times', text: format.moment(facts.finished_at ?? facts.created_at) }));
      this.#bar.title = `Reconcile ${facts.name}`;
      await this.#offer(String(facts.pond?.id));
      if (this.#pond?.inventories.length) await this.#update();
    });
  }

  /** @param {string} pond */
  async #offer(pond) {
    this.#pond = await getPond(pond);
    const { inventories } = this.#pond;
    this.#inventory.replaceChildren(...inventories.map(({ id, name, lines, created_at: at }) => h('option', { value: id, text: `${name} · ${lines} lines · ${format.moment(at)}` })));
    this.#inventory.hidden = !inventories.length;
    if (!inventories.length) this.#sum.textContent = 'No inventory was imported for this pond yet.';
    document.getElementById('import')?.toggleAttribute('open', !inventories.length);
  }

  /** @param {Inventory} made */
  async #imported({ id }) {
    await this.#offer(String(this.#pond?.id));
    this.options.set({ inventory: id, line: null });
  }

  async #update() {
    const { options } = this;
    history.replaceState(null, '', options.address);
    if (this.#wanted !== options.inventory) {
      this.#wanted = options.inventory;
      const went = await this.#fault.tell(async () => { this.answer = await reconcile(options.session, options.inventory); });
      if (!went) { this.answer = null; return; }
    }
    if (this.answer) this.#show(this.answer);
  }

  /** @param {Reconciliation} answer */
  #show(answer) {
    this.#inventory.value = answer.inventory.id;
    const focus = document.activeElement?.id;
    this.#counts.replaceChildren(...OUTCOMES.map(({ outcome, word, mark }) => h('button', { type: 'button', id: `only-${outcome}`, 'aria-pressed': String(this.options.only.has(outcome)),
      onClick: () => this.options.toggleOnly(outcome) }, h('span', { 'aria-hidden': 'true', text: mark }), ` ${word} ${answer.counts[outcome]}`)));
    if (focus?.startsWith('only-')) document.getElementById(focus)?.focus();
    const parts = OUTCOMES.map(({ outcome }) => counted(outcome, answer.counts[outcome]));
    const other = answer.same_pond ? '' : ' This inventory is of ANOTHER POND.';
    setText(this.#sum, `${format.count(answer.total)} lines = ${parts.join(' + ')}.${other}`);
    this.#export.hidden = false;
    this.#export.href = reconcileUrl(this.options.session, answer.inventory.id, { format: 'csv' });
    this.#table(answer);
    this.#showUndeclared(answer);
    void this.#evidence(answer);
  }

  /** @param {Reconciliation} answer */
  #table({ lines }) {
    const wanted = shown(lines, this.options.only);
    const kept = /** @type {HTMLElement | null} */ (this.#rows.contains(document.activeElement) ? document.activeElement : null)?.dataset.line;
    const scroll = this.#rows.parentElement?.scrollTop ?? 0;
    const rows = wanted.slice(0, MOST_ROWS).map((one) => this.#row(one));
    const more = wanted.length > MOST_ROWS ? `; the first ${MOST_ROWS} are shown, all are in the CSV` : '';
    this.#rows.replaceChildren(tableOf(`${wanted.length} of ${lines.length} lines${more}`, HEADS, rows, 'reconciled'));
    if (this.#rows.parentElement) this.#rows.parentElement.scrollTop = scroll;
    if (kept) [...this.#rows.querySelectorAll('button')].find((button) => button.dataset.line === kept)?.focus();
  }

  /** @param {ReconciledLine} one @returns {import('./dom.js').Child[]} */
  #row(one) {
    const { word, mark } = outcomeOf(one.outcome);
    const open = h('button', { type: 'button', class: 'plain', 'data-line': one.line, 'aria-pressed': String(one.line === this.options.line), text: one.item, onClick: () => this.options.set({ line: one.line }) });
    const observed = one.observed && one.observed.state !== 'unseen' ? reading(one.observed) : 'not observed';
    return [open, one.position, one.declared, one.date, observed, h('span', { class: 'outcome', 'data-outcome': one.outcome }, h('span', { class: 'change-mark', 'data-claimed': String(one.outcome === 'disagree'), 'aria-hidden': 'true', text: mark }), word),
      format.percent(one.confidence, 1), String(one.line)];
  }

  /** @param {Reconciliation} answer */
  #showUndeclared({ undeclared }) {
    this.#undeclared.hidden = !undeclared.length;
    const rows = undeclared.slice(0, MOST_ROWS).map(({ position, observed }) => [position, observed.state === 'unseen' ? 'not observed' : reading(observed)]);
    this.#undeclared.replaceChildren(h('summary', { text: undeclared.length === 1 ? '1 position that no line names' : `${format.count(undeclared.length)} positions that no line names` }), tableOf('Positions that no line names', ['Position', 'Observed'], rows));
  }

  /** @param {Reconciliation} answer */
  async #evidence({ lines }) {
    const line = lines.find((one) => one.line === this.options.line);
    if (!line || this.#detail.dataset.line === `${this.#wanted} ${line.line}`) return;
    this.#detail.dataset.line = `${this.#wanted} ${line.line}`;
    const { word } = outcomeOf(line.outcome);
    const asked = ++this.#asked;
    const [pictures, past] = [h('div', { class: 'before-after one' }, h('p', { class: 'quiet', text: 'Loading the snapshots…' })), h('div')];
    const says = line.observed && line.observed.state !== 'unseen' ? `${reading(line.observed)}, ${format.percent(line.observed.confidence, 1)} sure, ${line.observed.views} looks` : 'not observed';
    this.#detail.replaceChildren(h('div', { class: 'panel-head' }, h('h2', { id: 'line-title', text: `${line.item} · ${word}` })),
      facts({ Position: line.position, Declared: `${wordOf(/** @type {any} */ (line.declared))}, on ${line.date} (line ${line.line})`, Observed: says, 'Declared is right': line.confidence === null ? format.NONE : `${format.percent(line.confidence, 1)} probable` }),
      pictures, h('h2', { text: 'In all inspections of this pond' }), past);
    await this.#fault.tell(async () => {
      const [shownThere, history] = await Promise.all([evidenceOf('Observed', { session: this.options.session, name: this.answer?.name ?? '' }, line.position), getRodHistory(String(this.#pond?.id), line.position).catch(() => [])]);
      if (asked !== this.#asked) return;
      pictures.replaceChildren(shownThere);
      past.replaceChildren(pastStrip(history, line.position, { [this.options.session]: 'this' }));
    });
  }

  /** @param {number} by */
  #step(by) {
    const lines = this.answer ? shown(this.answer.lines, this.options.only) : [];
    if (!lines.length) return;
    const at = lines.findIndex(({ line }) => line === this.options.line);
    const next = lines[at < 0 ? 0 : (at + by + lines.length) % lines.length];
    this.options.set({ line: next.line });
    [...this.#rows.querySelectorAll('button')].find((button) => button.dataset.line === String(next.line))?.scrollIntoView({ block: 'nearest' });
  }

  /** @returns {import('./help.js').Action[]} */
  #actions() {
    const outcomes = OUTCOMES.map(({ outcome, word }, i) => ({ keys: [String(i + 1)], word: `List or leave out: ${word.toLowerCase()}`, run: () => this.options.toggleOnly(outcome) }));
    return [{ keys: ['n'], word: 'Next line', run: () => this.#step(1) }, { keys: ['p'], word: 'Line before it', run: () => this.#step(-1) }, ...outcomes,
      { keys: ['e'], word: 'Export as CSV', run: () => { if (this.answer) this.#export.click(); } }, { keys: ['t'], word: 'Light or dark', run: toggleTheme },
      { keys: ['i'], word: 'All inspections', run: () => location.assign('/?inspections') }, { keys: ['?'], word: 'These keys', run: () => this.help.showModal() }];
  }
}

/** @param {Record<string, string>} rows */
function facts(rows) {
  return h('dl', { class: 'facts' }, ...Object.entries(rows).flatMap(([term, value]) => [h('dt', { text: term }), h('dd', { text: value })]));
}
