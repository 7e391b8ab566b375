// @ts-check
/** A pond's rods by state, a bar an inspection: a pattern and a letter say the state, and a table says the numbers. */

import { format as addressOf } from '../state/address.js';
import * as format from '../state/format.js';
import { STATES, partsOf } from '../state/trend.js';
import { h } from './dom.js';
import { tableOf } from './pagekit.js';

const SVG = 'http://www.w3.org/2000/svg';
const BAR = { wide: 34, gap: 10, tall: 150, foot: 20 };
const LETTER_FROM = 0.1;
const LETTERS = { full: 'F', partial: 'P', empty: 'E', not_observed: '?' };

/** @param {Trend[]} trend the oldest first */
export function trendChart(trend) {
  if (!trend.length) return h('p', { class: 'quiet', text: 'There is no inspection of this pond yet.' });
  const width = trend.length * (BAR.wide + BAR.gap) + BAR.gap;
  const svg = s('svg', { width, height: BAR.tall + BAR.foot + 4, role: 'img', 'aria-label': 'Rods by state, a bar an inspection; the table below says the same', class: 'pond-trend' }, hatch(), ...trend.map(bar));
  const scroll = h('div', { class: 'past-scroll', tabindex: '0', role: 'region', 'aria-label': 'Rods by state through time' }, svg);
  requestAnimationFrame(() => { scroll.scrollLeft = scroll.scrollWidth; });
  const legend = 'F full, P partial, E empty, hatched: not observed';
  const rows = trend.toReversed().map((one) => [h('a', { href: addressOf({ session: one.session }), text: one.name }), format.moment(one.at), ...STATES.map(({ state }) => String(one.counts[state])),
    String(one.conflicting), format.percent(one.mean_fill, 1), format.percent(one.coverage)]);
  const heads = ['Inspection', 'When', ...STATES.map(({ word }) => word), 'Conflicting', 'Mean fill', 'Coverage'];
  return h('div', {}, scroll, h('p', { class: 'quiet', text: `${legend}. Oldest left; each bar is all rods of the layout then.` }),
    h('details', {}, h('summary', { text: 'The same as a table' }), tableOf(`${trend.length} inspections, the newest first`, heads, rows)));
}

/** @param {Trend} one @param {number} i */
function bar(one, i) {
  const x = BAR.gap + i * (BAR.wide + BAR.gap);
  const parts = partsOf(one).filter(({ size }) => size > 0).flatMap(({ state, from, size }) => {
    const y = 2 + (1 - from - size) * BAR.tall;
    const box = s('rect', { x, y, width: BAR.wide, height: size * BAR.tall, class: `part ${state}` });
    const letter = size >= LETTER_FROM ? [s('text', { x: x + BAR.wide / 2, y: y + (size * BAR.tall) / 2 + 4, class: `letter ${state}` }, LETTERS[state])] : [];
    return [box, ...letter];
  });
  const says = `${one.name}, ${format.moment(one.at)}: ${STATES.map(({ state, word }) => `${one.counts[state]} ${word.toLowerCase()}`).join(', ')}`;
  const day = format.moment(one.at).slice(5, 10);
  return s('g', {}, s('title', {}, says), ...parts, s('text', { x: x + BAR.wide / 2, y: BAR.tall + BAR.foot - 2, class: 'day' }, day));
}

function hatch() {
  const line = s('path', { d: 'M0 6 L6 0', class: 'hatch-line' });
  return s('defs', {}, s('pattern', { id: 'unseen', width: 6, height: 6, patternUnits: 'userSpaceOnUse' }, line));
}

/** @param {string} tag @param {Record<string, string | number>} props @param {...(Node | string)} children */
function s(tag, props, ...children) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(props)) element.setAttribute(name, String(value));
  element.append(...children);
  return element;
}
