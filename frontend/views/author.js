// @ts-check
/** Who sits here: a name that goes with what is said, kept in this browser. */

import { h } from './dom.js';

const KEY = 'pondwatch-author';

/** A field for the name, filled in as it was last. */
export function authorField() {
  const input = h('input', { name: 'by', required: true, maxlength: '64', autocomplete: 'name', value: localStorage.getItem(KEY) ?? '' });
  return h('label', {}, 'Your name', input);
}

/** The name in a form, remembered. @param {HTMLFormElement} form */
export function authorOf(form) {
  const name = String(new FormData(form).get('by') ?? '').trim();
  localStorage.setItem(KEY, name);
  for (const field of document.querySelectorAll('input[name=by]')) /** @type {HTMLInputElement} */ (field).defaultValue = name;
  return name;
}
