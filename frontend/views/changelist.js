// @ts-check
/** What the comparison says: whether there is one, how well the two lie on each other, and the rods that changed. */

import { compareUrl } from '../api/ponds.js';
import * as format from '../state/format.js';
import { CHANGES, REASONS, changeOf, listed, wordsOf } from '../state/comparison.js';
import { wordOf } from '../state/rods.js';
import { h } from './dom.js';

/** @typedef {import('../state/comparison.js').CompareOptions} CompareOptions */

const MOST_LISTED = 300;
const SORT_WORDS = { change: 'by change', rod: 'by rod', confidence: 'by confidence', residual: 'by residual' };

export class ChangeList {
  #options;
  #choose;
  #verdict = h('section', { id: 'verdict', 'aria-label': 'Whether the two can be compared' }, h('p', { class: 'quiet', text: 'Comparing…' }));
  #filters = h('div', { class: 'chips', role: 'group', 'aria-label': 'Which changes are listed' });
  #order = h('button', { type: 'button', id: 'order', onClick: () => this.#options.set({ descending: !this.#options.descending }) });
  #sort = h('select', { id: 'sort', 'aria-label': 'Order of the list', onChange: () => this.#options.set({ sort: /** @type {any} */ (this.#sort.value) }) },
    ...Object.entries(SORT_WORDS).map(([value, text]) => h('option', { value, text })));
  #export = h('a', { id: 'export', text: 'Export CSV', title: 'Every rod but those that are the same (E)', download: '' });
  #rows = h('ul', { class: 'changes', id: 'changes', 'aria-label': 'Changed rods' });
  #list = h('section', { hidden: true, 'aria-label': 'Changes' }, h('h2', { text: 'Rods that changed' }), this.#filters,
    h('div', { class: 'list-tools' }, this.#sort, this.#order, this.#export), this.#rows);
  element = h('div', { class: 'side-part' }, this.#verdict, this.#list);
  /** @type {CompareAnswer | null} */ #answer = null;
  /** In the order shown. @type {RodChange[]} */ rods = [];

  /** @param {CompareOptions} options @param {(id: string) => void} choose */
  constructor(options, choose) {
    this.#options = options;
    this.#choose = choose;
  }

  /** @param {CompareAnswer} answer */
  show(answer) {
    this.#answer = answer;
    this.#verdict.replaceChildren(...verdict(answer));
    this.#list.hidden = false;
    this.update();
  }

  update() {
    if (!this.#answer) return;
    const { only, sort, descending, rod } = this.#options;
    this.rods = listed(this.#answer, this.#options);
    this.#updateTools(this.#answer, only);
    this.#sort.value = sort;
    this.#order.textContent = descending ? '↓' : '↑';
    this.#order.setAttribute('aria-label', descending ? 'Falling; turn round' : 'Rising; turn round');
    const shown = this.rods.slice(0, MOST_LISTED);
    const more = this.rods.length - shown.length;
    const kept = this.#rows.contains(document.activeElement) ? /** @type {HTMLElement} */ (document.activeElement).dataset.rod : null;
    this.#rows.replaceChildren(...shown.map((one) => h('li', {}, this.#row(one, one.rod_id === rod))),
      more > 0 && h('li', { class: 'quiet', text: `and ${more} more, all in the table (D)` }) || '',
      !shown.length && h('li', { class: 'quiet', text: nothing(this.#answer, only) }) || '');
    if (kept) [...this.#rows.querySelectorAll('button')].find((button) => button.dataset.rod === kept)?.focus();
  }

  /** @param {CompareAnswer} answer @param {Set<string>} only */
  #updateTools({ base, with: later, counts }, only) {
    const focus = document.activeElement?.id;
    this.#filters.replaceChildren(...CHANGES.map(({ change, word, mark }) => h('button', { type: 'button', id: `only-${change}`, 'aria-pressed': String(only.has(change)),
      onClick: () => this.#options.toggleOnly(change) }, h('span', { 'aria-hidden': 'true', text: mark }), ` ${word} ${counts[change]}`)));
    if (focus?.startsWith('only-')) document.getElementById(focus)?.focus();
    const sort = { change: 'change', rod: 'rod_id', confidence: 'confidence', residual: 'residual' }[this.#options.sort];
    this.#export.href = compareUrl(base.session, later.session, { format: 'csv', sort, order: this.#options.descending ? 'desc' : 'asc' });
  }

  export() { this.#export.click(); }

  /** @param {RodChange} rod @param {boolean} chosen */
  #row(rod, chosen) {
    const { word, mark } = changeOf(rod.change);
    const claimed = rod.change !== 'not_comparable';
    const from = `${reading(rod.base)} → ${reading(rod.with)}`;
    return h('button', { type: 'button', 'data-rod': rod.rod_id, 'data-change': rod.change, 'aria-pressed': String(chosen), onClick: () => this.#choose(rod.rod_id) },
      h('span', { class: 'change-mark', 'data-claimed': String(claimed), 'aria-hidden': 'true', text: mark }),
      h('span', { class: 'what' }, h('strong', { text: `${rod.rod_id} · ${word}` }), h('span', { text: claimed ? from : REASONS[rod.reason ?? ''] ?? '' }),
        claimed && rod.word ? h('span', { class: 'quiet', text: wordsOf(rod) }) : ''),
      h('span', { class: 'share', text: claimed ? format.percent(rod.confidence, 1) : '' }));
  }
}

/** @param {SideReading} side */
export function reading({ state, fill, conflicting }) {
  if (conflicting) return wordOf('conflicting').toLowerCase();
  return state === 'partial' ? `partial ${format.percent(fill)}` : wordOf(state).toLowerCase();
}

/** @param {CompareAnswer} answer @param {Set<string>} only */
function nothing({ comparable, rods, not_comparable: withheld }, only) {
  if (!only.size || rods.length + withheld.length) return 'No rod is of the kinds chosen above.';
  return comparable ? 'No rod changed.' : 'No difference is claimed.';
}

/** @param {CompareAnswer} answer */
function verdict(answer) {
  const { comparable, sentence, residual, counts, compared, not_observed: unseen } = answer;
  const claim = comparable ? h('p', { class: 'sentence', id: 'sentence', text: sentence })
    : h('div', { class: 'note bad', id: 'sentence', role: 'alert' }, h('strong', { text: 'NOT COMPARABLE: no difference is claimed' }), h('p', { text: sentence }));
  const changed = counts.filled + counts.emptied + counts.partly;
  return [claim, h('dl', { class: 'figures' },
    figure('Changed', format.count(changed), `of ${format.count(compared)} observed in both`, changed > 0),
    figure('Not comparable', format.count(counts.not_comparable), `${format.count(unseen)} not observed in one or both`, false)), residualTable(residual), ...layouts(answer)];
}

/** @param {string} term @param {string} value @param {string} more @param {boolean} attention */
function figure(term, value, more, attention) {
  return h('div', { class: attention ? 'figure attention' : 'figure' }, h('dt', { text: term }), h('dd', {}, value, ' ', h('small', { text: more })));
}

/** @param {Residual} residual */
function residualTable(residual) {
  if (!residual.rods) return h('p', { class: 'quiet', id: 'residual', text: 'How well the two mosaics lie on each other was not measured: no rod\'s ring was found in both.' });
  const within = (residual.median_px ?? Infinity) <= residual.limit_px;
  /** @param {string} name @param {number | null} px @param {number | null} mm */
  const row = (name, px, mm) => h('tr', {}, h('th', { scope: 'row', text: name }), h('td', { text: px === null ? format.NONE : format.figure(px, 2, 'px') }), h('td', { text: mm === null ? format.NONE : format.figure(mm, 3, 'mm') }));
  const heads = ['', 'px', 'mm'].map((text) => h('th', { scope: 'col', text }));
  return h('table', { class: 'small residual', id: 'residual' },
    h('caption', { text: `Residual between the mosaics at ${format.count(residual.rods)} rods: ${within ? 'within the limit' : 'OVER THE LIMIT'}` }),
    h('thead', {}, h('tr', {}, h('td'), ...heads.slice(1))),
    h('tbody', {}, row('Median', residual.median_px, residual.median_mm), row('95\u00a0%', residual.p95_px, residual.p95_mm), row('Largest', residual.max_px, residual.max_mm),
      row('Limit', residual.limit_px, residual.limit_mm)));
}

/** @param {CompareAnswer} answer */
function layouts({ only_in_base: before, only_in_with: after }) {
  if (!before.length && !after.length) return [];
  return [h('p', { class: 'quiet', text: `The layouts differ: ${before.length} rods only before, ${after.length} only after. They are not compared.` })];
}
