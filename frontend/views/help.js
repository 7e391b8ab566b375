// @ts-check
/** The keys, in a dialog that lists what the page listens to. */

import { h } from './dom.js';

/** @typedef {{keys: string[], word: string, run: () => void}} Action */

/** @param {Action[]} actions */
export function helpDialog(actions) {
  const rows = actions.flatMap(({ keys, word }) => [h('dt', {}, ...keys.slice(0, 1).map((key) => h('kbd', { text: NAMES[key] ?? key.toUpperCase() }))), h('dd', { text: word })]);
  rows.push(h('dt', {}, h('kbd', { text: 'Arrows' })), h('dd', { text: 'Pan, while the map has the focus' }));
  rows.push(h('dt', {}, h('kbd', { text: 'Tab' })), h('dd', { text: 'Next control; Enter presses it' }));
  const close = h('button', { type: 'button', text: 'Close', onClick: () => dialog.close() });
  const dialog = h('dialog', { id: 'help', 'aria-labelledby': 'help-title' }, h('h2', { id: 'help-title', text: 'Keys' }), h('dl', { class: 'keys' }, ...rows), close);
  return dialog;
}

/** @type {Record<string, string>} */
const NAMES = { Escape: 'Esc', ' ': 'Space' };
