// @ts-check
/** Every rod that is listed, as a table in the place of the maps. */

import { REASONS, changeOf, wordsOf } from '../state/comparison.js';
import * as format from '../state/format.js';
import { reading } from './changelist.js';
import { h } from './dom.js';

const HEADS = ['Rod', 'Change', 'Before', 'After', 'Looks', 'Confidence', 'It differs', 'Residual', 'x', 'y', 'Remark'];

export class CompareTable {
  #body = h('div', { class: 'table-scroll', tabindex: '0', role: 'region', 'aria-label': 'Table of changes' });
  #back = h('button', { type: 'button', text: 'Back to the maps' });
  #choose;
  element = h('section', { class: 'tables', id: 'tables', 'aria-label': 'Table', hidden: true }, h('div', { class: 'toolbar' }, h('strong', { text: 'Changes as a table' }), h('span', { class: 'spacer' }), this.#back), this.#body);

  /** @param {(id: string) => void} choose @param {() => void} close */
  constructor(choose, close) {
    this.#choose = choose;
    this.#back.addEventListener('click', close);
  }

  /** @param {boolean} open @param {RodChange[]} rods */
  toggle(open, rods) {
    this.element.hidden = !open;
    if (!open) return;
    this.update(rods);
    this.#back.focus();
  }

  /** @param {RodChange[]} rods */
  update(rods) {
    if (this.element.hidden) return;
    const rows = rods.map((rod) => h('tr', {}, h('th', { scope: 'row' }, h('button', { type: 'button', class: 'plain', text: rod.rod_id, onClick: () => this.#choose(rod.rod_id) })), ...cells(rod).map((text) => h('td', { text }))));
    const heads = HEADS.map((text) => h('th', { scope: 'col', text }));
    this.#body.replaceChildren(h('table', {}, h('caption', { text: `${rods.length} rods` }), h('thead', {}, h('tr', {}, ...heads)), h('tbody', {}, ...rows)));
  }
}

/** @param {RodChange} rod */
function cells(rod) {
  const claimed = rod.change !== 'not_comparable';
  const { word, mark } = changeOf(rod.change);
  return [`${mark} ${word}`, reading(rod.base), reading(rod.with), `${rod.base.views}, ${rod.with.views}`, claimed ? format.percent(rod.confidence, 1) : format.NONE,
    claimed ? format.percent(rod.p_changed, 2) : format.NONE, rod.residual_px === null ? format.NONE : `${format.figure(rod.residual_px, 2, 'px')} · ${format.figure(rod.residual_mm ?? NaN, 3, 'mm')}`,
    format.figure(rod.x_m, 3, 'm'), format.figure(rod.y_m, 3, 'm'), claimed ? wordsOf(rod) : REASONS[rod.reason ?? ''] ?? ''];
}
