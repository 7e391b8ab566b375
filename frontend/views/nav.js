// @ts-check
/** The way to the other pages. */

import { h } from './dom.js';

/** @param {'inspections' | 'ponds' | ''} here */
export function navigation(here = '') {
  const pages = /** @type {const} */ ([['inspections', 'Inspections'], ['ponds', 'Ponds']]);
  return h('nav', { class: 'pages', 'aria-label': 'Pages' }, ...pages.map(([name, text]) => h('a', { href: `/?${name}`, text, 'aria-current': here === name ? 'page' : null })));
}

/** What can be done with one inspection, as links. @param {{id: string, state: string}} session */
export function sessionLinks({ id, state }) {
  const link = (/** @type {string} */ href, /** @type {string} */ text, /** @type {string} */ title) => h('a', { href, text, title });
  return [link(`/?compare=last,${id}`, 'Compare', 'With the last inspection of this pond before it'), link(`/?reconcile=${id}`, 'Reconcile', 'With a declared inventory'),
    ...(state === 'finished' ? [link(`/?methods=${id}`, 'Methods', 'Again with another method')] : [])];
}
