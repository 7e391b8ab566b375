// @ts-check
/** What pages of forms and tables share: a table, a form whose refusal is said beside it. */

import { Problem } from '../api/client.js';
import { h } from './dom.js';

/** @typedef {import('./dom.js').Child} Child */

/** The first cell of each row names it. @param {string} caption @param {string[]} heads @param {Child[][]} rows @param {string} [id] */
export function tableOf(caption, heads, rows, id) {
  const body = rows.map((cells) => h('tr', {}, ...cells.map((cell, i) => (i ? h('td', {}, cell) : h('th', { scope: 'row' }, cell)))));
  return h('div', { class: 'table-box', tabindex: '0', role: 'region', 'aria-label': caption }, h('table', { id }, h('caption', { text: caption }),
    h('thead', {}, h('tr', {}, ...heads.map((text) => h('th', { scope: 'col', text })))), h('tbody', {}, ...body)));
}

/** A box for what went wrong. */
export class Fault {
  element = h('div', { class: 'note bad', role: 'alert', hidden: true });

  /** Run it; a problem is said here. @param {() => Promise<void>} run @returns {Promise<boolean>} whether it went well */
  async tell(run) {
    try {
      this.element.hidden = true;
      await run();
      return true;
    } catch (error) {
      if (!(error instanceof Error)) throw error;
      if (!(error instanceof Problem) && error.constructor !== Error) throw error; // a fault of the page's own
      this.show(h('p', { text: error.message }));
      return false;
    }
  }

  /** @param {...Child} words */
  show(...words) {
    this.element.hidden = false;
    this.element.replaceChildren(...words.filter((word) => word instanceof Node));
  }
}

/** @param {{id: string, word: string, send: (form: HTMLFormElement) => Promise<void>, fault?: Fault}} made @param {...HTMLElement} fields */
export function formOf({ id, word, send, fault = new Fault() }, ...fields) {
  const button = h('button', { type: 'submit', text: word });
  const form = h('form', { id, class: 'stack' }, ...fields, h('div', {}, button), fault.element);
  form.addEventListener('submit', (event) => {
    event.preventDefault();
    button.disabled = true; // once is enough
    void fault.tell(() => send(form)).finally(() => { button.disabled = false; });
  });
  return form;
}

/** @param {string} text @param {HTMLElement} field */
export function labelled(text, field) {
  return h('label', {}, text, field);
}

/** The file that was chosen. @param {HTMLInputElement} input */
export function fileOf(input) {
  const file = input.files?.[0];
  if (!file) throw new Error('Choose a file.');
  return file;
}
