// @ts-check
/** The keys, in a dialog that lists what the page listens to. */

import { h } from './dom.js';

/** @typedef {{keys: string[], word: string, run: () => void, group?: string}} Action */

/** @param {Action[]} actions */
export function helpDialog(actions) {
  const groups = new Map([...actions].map(({ group = 'Page' }) => [group, /** @type {HTMLElement[]} */ ([])]));
  for (const { keys, word, group = 'Page' } of actions) groups.get(group)?.push(...row(NAMES[keys[0]] ?? keys[0].toUpperCase(), word));
  groups.get('Map')?.push(...row('Arrows', 'Pan, while the map has the focus'));
  groups.get('Page')?.push(...row('Tab', 'Next control; Enter presses it'));
  const sections = [...groups].map(([title, rows]) => h('section', {}, h('h3', { text: title }), h('dl', { class: 'keys' }, ...rows)));
  const close = h('button', { type: 'button', 'aria-label': 'Close', title: 'Close (Esc)', text: '✕', onClick: () => dialog.close() });
  const dialog = h('dialog', { id: 'help', 'aria-labelledby': 'help-title' },
    h('div', { class: 'panel-head' }, h('h2', { id: 'help-title', text: 'Keys' }), close), h('div', { class: 'key-groups' }, ...sections));
  return dialog;
}

/** @param {string} key @param {string} word */
function row(key, word) {
  return [h('dt', {}, h('kbd', { text: key })), h('dd', { text: word })];
}

/** @type {Record<string, string>} */
const NAMES = { Escape: 'Esc', ' ': 'Space' };
