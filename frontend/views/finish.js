// @ts-check
/** Finish an inspection, after a question: it cannot be opened again. */

import { Problem, finishSession } from '../api/client.js';
import { h } from './dom.js';

export class Finish {
  #fault = h('p', { class: 'note bad', role: 'alert', hidden: true });
  button = h('button', { type: 'button', id: 'finish', text: 'Finish…', title: 'No more snapshots; run the last correction', onClick: () => this.dialog.showModal() });
  dialog;

  /** @param {string} session */
  constructor(session) {
    this.dialog = h('dialog', { id: 'finish-dialog', 'aria-labelledby': 'finish-title' }, h('h2', { id: 'finish-title', text: 'Finish this inspection?' }),
      h('p', { text: 'It takes no more snapshots, and cannot be opened again. The last correction over everything runs now.' }), this.#fault,
      h('div', { class: 'pager' }, h('button', { type: 'button', text: 'Go on inspecting', onClick: () => this.dialog.close() }),
        h('button', { type: 'button', id: 'finish-now', text: 'Finish', onClick: () => void this.#finish(session) })));
  }

  /** @param {string} state of the inspection */
  update(state) { this.button.hidden = !['open', 'running', 'failed'].includes(state); }

  /** @param {string} session */
  async #finish(session) {
    try {
      await finishSession(session);
      this.dialog.close();
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      this.#fault.textContent = error.message;
      this.#fault.hidden = false;
    }
  }
}
