// @ts-check
/** Closer, farther, all of it: buttons on the map. */

import { h } from './dom.js';

/** @param {import('./pondview.js').PondView} view */
export function mapTools({ map }) {
  const button = (/** @type {string} */ text, /** @type {string} */ title, /** @type {() => void} */ onClick) =>
    h('button', { type: 'button', title, 'aria-label': title, text, onClick });
  return h('div', { class: 'map-tools' }, button('+', 'Closer (+)', () => map.zoom(1.5)),
    button('−', 'Farther (-)', () => map.zoom(1 / 1.5)), button('⤢', 'Whole pond (0)', () => map.fit()));
}
