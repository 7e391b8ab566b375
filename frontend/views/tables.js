// @ts-check
/** What the map shows, as tables: rods, robots, snapshots. */

import * as format from '../state/format.js';
import { robotViews } from '../state/robots.js';
import { VERDICTS, labelOf, verdictOf, wordOf } from '../state/rods.js';
import { h } from './dom.js';

/** @typedef {import('../state/inspection.js').Inspection} Inspection */
/** @typedef {'rods' | 'robots' | 'snapshots'} Tab */

const MOST_ROWS = 1000;
/** @type {Record<Tab, string[]>} */
const HEADS = {
  rods: ['Rod', 'State', 'Fill', 'Confidence', 'Looks', 'Last seen', 'x', 'y'],
  robots: ['Robot', 'Last heard', 'Snapshot', 'Status', 'x', 'y', 'Heading', 'Moved by'],
  snapshots: ['Robot', 'Snapshot', 'Received', 'Status', 'x', 'y', 'Heading', 'One sigma'],
};

export class Tables {
  #of;
  #looks;
  #choose;
  /** @type {Tab} */ #tab = 'rods';
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
    this.#tab = tab;
    for (const button of this.#tabs) button.setAttribute('aria-pressed', String(button.dataset.tab === tab));
    this.#filter.hidden = tab !== 'rods';
    this.update();
  }

  update() {
    if (this.element.hidden || this.#body.contains(document.activeElement)) return; // rows do not move under a reader's hand
    const all = { rods: () => this.#rods(), robots: () => this.#robots(), snapshots: () => this.#snapshots() }[this.#tab]();
    const heads = HEADS[this.#tab].map((text) => h('th', { scope: 'col', text }));
    const rows = all.slice(0, MOST_ROWS).map((cells) => h('tr', {}, ...cells.map((cell, i) => (i ? h('td', {}, cell) : h('th', { scope: 'row' }, cell)))));
    const more = all.length > MOST_ROWS ? `; the first ${MOST_ROWS} are shown` : '';
    this.#body.replaceChildren(h('table', {}, h('caption', { text: `${all.length} ${this.#tab}${more}` }), h('thead', {}, h('tr', {}, ...heads)), h('tbody', {}, ...rows)));
  }

  /** @returns {(string | Node)[][]} */
  #rods() {
    const looks = this.#looks();
    const nowMs = this.#of().serverMs(Date.now());
    const rods = (this.#of().facts.pond?.rods ?? []).map((layout) => ({ layout, row: this.#of().rod(layout.id) }));
    return rods.filter(({ row }) => !this.#filter.value || verdictOf(row) === this.#filter.value).map(({ layout, row }) => {
      const seenMs = looks?.rods.get(layout.id)?.newestMs;
      const open = h('button', { type: 'button', class: 'plain', text: layout.id, onClick: () => this.#choose(layout.id) });
      return [open, `${labelOf(row).charAt(0)} · ${wordOf(verdictOf(row))}`, format.percent(row.fill, 1), row.views ? format.percent(row.confidence, 1) : format.NONE,
        String(row.views), seenMs ? `${format.age((nowMs - seenMs) / 1000)} ago` : 'never', `${layout.x_m.toFixed(3)} m`, `${layout.y_m.toFixed(3)} m`];
    });
  }

  #robots() {
    return robotViews(this.#of(), Date.now()).map(({ name, pose, ageS, hearing, driftM }) => [name,
      hearing === 'silent' ? `SILENT ${format.age(ageS)}` : `${format.age(ageS)} ago`, `#${pose.sequence}`, pose.status, ...place(pose), format.length(driftM)]);
  }

  #snapshots() {
    const newest = [...this.#of().poses.values()].sort((a, b) => (b.received_at ?? '').localeCompare(a.received_at ?? ''));
    return newest.map((pose) => [pose.robot, `#${pose.sequence}`, format.moment(pose.received_at), pose.status, ...place(pose), format.length(pose.sigma_xy_m)]);
  }
}

/** @param {PoseRow} pose */
function place({ x_m, y_m, theta_rad }) {
  return [x_m === null ? format.NONE : `${x_m.toFixed(4)} m`, y_m === null ? format.NONE : `${y_m.toFixed(4)} m`, format.angle(theta_rad)];
}

/** @param {Tab} tab */
function wordFor(tab) {
  return tab.charAt(0).toUpperCase() + tab.slice(1);
}
