// @ts-check
/** The mark of an alarm: a letter in a shape, filled while it asks for somebody. Colour only repeats what they say. */

import { h } from './dom.js';

/** @param {import('../state/alarms.js').Level} level @param {boolean} rings */
export function mark({ name, letter }, rings) {
  return h('span', { class: 'mark', 'data-level': name, 'data-rings': String(rings), title: `${name} severity`, text: letter });
}
