// @ts-check
/** The mark of an alarm: a letter in a shape; filled while it is active and nobody acknowledged it, broken when only that is left. */

import { h } from './dom.js';

const WORDS = { active: 'not acknowledged', returned: 'returned to normal, not acknowledged', answered: 'acknowledged' };

/** @param {import('../state/alarms.js').Level} level @param {import('../state/alarms.js').Call} call */
export function mark({ name, letter }, call) {
  return h('span', { class: 'mark', 'data-level': name, 'data-call': call, title: `${name} severity, ${WORDS[call]}`, text: letter });
}
