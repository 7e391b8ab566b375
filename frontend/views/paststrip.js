// @ts-check
/** One rod through all inspections of its pond, a cell each, the oldest first; where it was not observed there is a gap. */

import { Symbols } from '../map/symbols.js';
import { format as addressOf } from '../state/address.js';
import * as format from '../state/format.js';
import { wordOf } from '../state/rods.js';
import { h } from './dom.js';
import { rodPalette } from './theme.js';

const GAP_WORDS = { not_observed: 'not observed', not_in_layout: 'not in the layout then' };

/** @param {PastInspection[]} past @param {string} rod @param {Record<string, string>} [names] words below the cells of some sessions */
export function pastStrip(past, rod, names = {}) {
  const symbols = new Symbols(rodPalette());
  const cells = past.map((one) => cell(one, rod, symbols, names[one.session]));
  const seen = past.filter(({ state }) => state !== null).length;
  const list = h('ol', { class: 'past', 'aria-label': `Rod ${rod}: one cell an inspection, the oldest first` }, ...cells);
  const strip = h('div', { class: 'past-scroll', tabindex: '0', role: 'region', 'aria-label': `Past of rod ${rod}` }, list);
  requestAnimationFrame(() => { strip.scrollLeft = strip.scrollWidth; }); // the newest in sight
  return h('div', {}, strip, h('p', { class: 'quiet', text: `${past.length} inspections, observed in ${seen}. A gap: not observed. Oldest left.` }));
}

/** @param {PastInspection} one @param {string} rod @param {Symbols} symbols @param {string} [is] */
function cell(one, rod, symbols, is) {
  const said = wordsOf(one);
  const title = `${one.name}, ${format.moment(one.at)}: ${said}${one.session_state === 'finished' ? '' : ` (${one.session_state})`}`;
  const link = h('a', { href: addressOf({ session: one.session, rod }), title, 'aria-label': title });
  if (one.state !== null) link.append(symbol(one, symbols));
  return h('li', { class: one.state === null ? 'gap' : 'seen', 'data-state': one.state ?? one.reason ?? '', 'data-is': is }, link);
}

/** What was read, for a person. @param {PastInspection} one */
export function wordsOf({ state, fill, conflicting, confidence, reason }) {
  if (state === null) return GAP_WORDS[/** @type {keyof typeof GAP_WORDS} */ (reason)] ?? 'not observed';
  const word = conflicting ? 'conflicting' : state === 'partial' ? `partial ${format.percent(fill)}` : wordOf(state).toLowerCase();
  return `${word}, ${format.percent(confidence)} sure`;
}

/** A copy: the symbol itself is kept for others. @param {PastInspection} one @param {Symbols} symbols */
function symbol({ state, fill, confidence, views, conflicting }, symbols) {
  const kept = symbols.of({ rod_id: '', state: /** @type {RodRow['state']} */ (state), fill, confidence: confidence ?? 0, views, conflicting }, 12);
  const copy = /** @type {HTMLCanvasElement} */ (kept.cloneNode());
  copy.getContext('2d')?.drawImage(kept, 0, 0);
  return copy;
}
