// @ts-check
/** Start an inspection: a name, and a layout from a file or an earlier inspection. What is wrong is said by its field. */

import { getSession, startSession } from '../api/client.js';
import { format as addressOf } from '../state/address.js';
import { documentOf, readLayout } from '../state/newinspection.js';
import { h } from './dom.js';

const NONE = { value: '', text: 'none' };

export class StartForm {
  #name = h('input', { id: 'start-name', required: true, maxlength: '200' });
  #file = h('input', { id: 'start-file', type: 'file', accept: '.json,application/json' });
  #earlier = h('select', { id: 'start-earlier' }, h('option', NONE));
  #fault = h('p', { class: 'note bad', role: 'alert', hidden: true });
  #form = h('form', { class: 'stack', id: 'start-form' }, h('label', {}, 'Name', this.#name),
    h('label', {}, 'Layout from a file: a session.json, or a layout alone', this.#file),
    h('label', {}, 'Earlier inspection, for what the file does not say', this.#earlier), h('button', { type: 'submit', text: 'Start' }), this.#fault);
  element = h('details', { id: 'start' }, h('summary', { text: 'Start an inspection' }), this.#form);

  constructor() {
    this.#form.addEventListener('submit', (event) => {
      event.preventDefault();
      void this.#send();
    });
  }

  /** Inspections whose layout may be taken; the one that is chosen stays. @param {SessionFacts[]} sessions */
  offer(sessions) {
    if (this.#earlier.value || this.#earlier.contains(document.activeElement)) return;
    this.#earlier.replaceChildren(h('option', NONE), ...sessions.map(({ id, name }) => h('option', { value: id, text: name || id })));
  }

  async #send() {
    this.#fault.hidden = true;
    try {
      const file = this.#file.files?.[0];
      const layout = file ? readLayout(await file.text(), file.name) : null;
      const earlier = this.#earlier.value ? await getSession(this.#earlier.value) : null;
      const { id } = await startSession(documentOf(this.#name.value.trim(), layout, /** @type {any} */ (earlier)));
      location.assign(addressOf({ session: id }));
    } catch (error) {
      this.#fault.textContent = /** @type {Error} */ (error).message;
      this.#fault.hidden = false;
    }
  }
}
