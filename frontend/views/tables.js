// @ts-check
/** What the map shows, as tables: rods, robots, snapshots. */

import * as format from '../state/format.js';
import { robotViews, saidOf } from '../state/robots.js';
import { VERDICTS, fillOf, labelOf, verdictOf, wordOf } from '../state/rods.js';
import { sorted } from '../state/sorting.js';
import { h } from './dom.js';

/** @typedef {import('../state/inspection.js').Inspection} Inspection */
/** @typedef {import('../state/sorting.js').Cell} Cell */
/** @typedef {'rods' | 'robots' | 'snapshots'} Tab */

const MOST_ROWS = 1000;
/** @type {Record<Tab, string[]>} */
const HEADS = {
  rods: ['Rod', 'State', 'Fill', 'Confidence', 'Looks', 'In view, 30 min', 'Last seen', 'Place known to', 'x', 'y'],
  robots: ['Robot', 'Last heard', 'Snapshot', 'Status', 'x', 'y', 'Heading', 'Moved by', 'Says'],
  snapshots: ['Robot', 'Snapshot', 'Received', 'Status', 'x', 'y', 'Heading', 'One sigma'],
};

export class Tables {
  #of;
  #looks;
  #choose;
  /** @type {Tab} */ #tab = 'rods';
  /** @type {{column: number, descending: boolean} | null} */ #order = null;
  #filter = h('select', { 'aria-label': 'Only rods that are', onChange: () => this.update() }, h('option', { value: '', text: 'All states' }),
    ...VERDICTS.map(({ verdict, word }) => h('option', { value: verdict, text: word })));
  #tabs;
  #body = h('div', { class: 'table-scroll', tabindex: '0', role: 'region', 'aria-label': 'Table' });

  /** @param {() => Inspection} of @param {() => import('../state/looks.js').Looks | null} looks @param {(rodId: string) => void} choose @param {() => void} close */
  constructor(of, looks, choose, close) {
    this.#of = of;
    this.#looks = looks;
    this.#choose = choose;
    this.#tabs = /** @type {Tab[]} */ (Object.keys(HEADS)).map((tab) => h('button', { type: 'button', 'data-tab': tab, text: wordFor(tab), onClick: () => this.#show(tab) }));
    const back = h('button', { type: 'button', text: 'Back to the map', onClick: close });
    this.element = h('section', { class: 'tables', id: 'tables', 'aria-label': 'Tables', hidden: true }, h('div', { class: 'toolbar' }, ...this.#tabs, this.#filter, h('span', { class: 'spacer' }), back), this.#body);
  }

  /** @param {boolean} open */
  toggle(open) {
    this.element.hidden = !open;
    if (!open) return;
    this.#show(this.#tab);
    this.#tabs[0].focus();
  }

  /** @param {Tab} tab */
  #show(tab) {
    if (tab !== this.#tab) this.#order = null;
    this.#tab = tab;
    for (const button of this.#tabs) button.setAttribute('aria-pressed', String(button.dataset.tab === tab));
    this.#filter.hidden = tab !== 'rods';
    this.update();
  }

  update() {
    if (this.element.hidden || this.#body.contains(document.activeElement)) return; // rows do not move under a reader's hand
    this.#draw();
  }

  #draw() {
    const all = { rods: () => this.#rods(), robots: () => this.#robots(), snapshots: () => this.#snapshots() }[this.#tab]();
    const ordered = this.#order ? sorted(all, this.#order.column, this.#order.descending) : all;
    const rows = ordered.slice(0, MOST_ROWS).map((cells) => h('tr', {}, ...cells.map(({ show }, i) => (i ? h('td', {}, show) : h('th', { scope: 'row' }, show)))));
    const more = all.length > MOST_ROWS ? `; the first ${MOST_ROWS} are shown` : '';
    this.#body.replaceChildren(h('table', {}, h('caption', { text: `${all.length} ${this.#tab}${more}` }),
      h('thead', {}, h('tr', {}, ...HEADS[this.#tab].map((text, column) => this.#head(text, column)))), h('tbody', {}, ...rows)));
  }

  /** @param {string} text @param {number} column */
  #head(text, column) {
    const order = this.#order?.column === column ? (this.#order.descending ? 'descending' : 'ascending') : 'none';
    return h('th', { scope: 'col', 'aria-sort': order }, h('button', { type: 'button', class: 'sort', title: `Order by ${text}`, text, onClick: () => this.#sort(column) }));
  }

  /** By this column; the other way round where it is so already. @param {number} column */
  #sort(column) {
    this.#order = { column, descending: this.#order?.column === column && !this.#order.descending };
    this.#draw();
    /** @type {HTMLElement[]} */ ([...this.#body.querySelectorAll('.sort')])[column].focus();
  }

  /** @returns {Cell[][]} */
  #rods() {
    const looks = this.#looks();
    const nowMs = this.#of().serverMs(Date.now());
    const rods = (this.#of().facts.pond?.rods ?? []).map((layout) => ({ layout, row: this.#of().rod(layout.id) }));
    return rods.filter(({ row }) => !this.#filter.value || verdictOf(row) === this.#filter.value).map(({ layout, row }) => {
      const seen = looks?.rods.get(layout.id);
      const sigmaM = looks?.at(layout.x_m, layout.y_m)?.sigmaM ?? Infinity;
      const open = h('button', { type: 'button', class: 'plain', text: layout.id, onClick: () => this.#choose(layout.id) });
      const said = row.by_hand ? ', by hand' : '';
      return [{ show: open }, { show: `${labelOf(row).charAt(0)} · ${wordOf(verdictOf(row))}${said}` }, { show: format.percent(fillOf(row), 1), by: fillOf(row) },
        { show: row.views ? format.percent(row.confidence, 1) : format.NONE, by: row.views ? row.confidence : null }, number(row.views), number(seen?.recent ?? 0),
        seen?.newestMs ? { show: `${format.age((nowMs - seen.newestMs) / 1000)} ago`, by: nowMs - seen.newestMs } : { show: 'never', by: null },
        length(Number.isFinite(sigmaM) ? sigmaM : null), metres(layout.x_m, 3), metres(layout.y_m, 3)];
    });
  }

  /** @returns {Cell[][]} */
  #robots() {
    return robotViews(this.#of(), Date.now()).map(({ name, pose, ageS, hearing, driftM }) => [{ show: name },
      { show: heard(hearing, format.age(ageS)), by: ageS },
      { show: `#${pose.sequence}` }, { show: pose.status }, ...place(pose), length(driftM), { show: saidOf(pose) || format.NONE }]);
  }

  /** @returns {Cell[][]} */
  #snapshots() {
    const newest = [...this.#of().poses.values()].sort((a, b) => (b.received_at ?? '').localeCompare(a.received_at ?? ''));
    return newest.map((pose) => [{ show: pose.robot }, { show: `#${pose.sequence}` }, { show: format.moment(pose.received_at), by: pose.received_at ?? null },
      { show: pose.status }, ...place(pose), length(pose.sigma_xy_m)]);
  }
}

/** @param {import('../state/robots.js').Hearing} hearing @param {string} age */
function heard(hearing, age) {
  if (hearing === 'silent') return `SILENT ${age}`;
  return hearing === 'behind' ? `queued ${age}` : `${age} ago`;
}

/** @param {number} value @returns {Cell} */
function number(value) { return { show: format.count(value), by: value }; }

/** @param {number | null} m @param {number} digits @returns {Cell} */
function metres(m, digits) { return { show: m === null ? format.NONE : format.figure(m, digits, 'm'), by: m }; }

/** @param {number | null} m @returns {Cell} */
function length(m) { return { show: format.length(m), by: m }; }

/** @param {PoseRow} pose @returns {Cell[]} */
function place({ x_m, y_m, theta_rad }) {
  return [metres(x_m, 4), metres(y_m, 4), { show: format.angle(theta_rad), by: theta_rad }];
}

/** @param {Tab} tab */
function wordFor(tab) {
  return tab.charAt(0).toUpperCase() + tab.slice(1);
}
