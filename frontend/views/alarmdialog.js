// @ts-check
/** Why something is done to alarms, and by whom; for how long where they are shelved. */

import { Problem, actOnAlarms } from '../api/client.js';
import { ACT_WORDS, nameOf } from '../state/alarms.js';
import { authorField, authorOf } from './author.js';
import { h, setText } from './dom.js';

/** @typedef {import('../state/alarms.js').Alarm} Alarm */
/** @typedef {import('../state/alarms.js').Act} Act */

const MOST_NAMED = 3;
const TIMES = [['300', '5 minutes'], ['1800', '30 minutes'], ['3600', '1 hour'], ['14400', '4 hours'], ['28800', '8 hours'], ['', 'until it is over']];

export class AlarmDialog {
  #session;
  /** @type {Act} */ #act = 'acknowledge';
  /** @type {Alarm[]} */ #alarms = [];
  #title = h('h2', { id: 'alarm-dialog-title' });
  #what = h('p');
  #comment = h('textarea', { name: 'comment', required: true, maxlength: '2000', rows: '3' });
  #time = h('select', { name: 'for_s' }, ...TIMES.map(([value, text]) => h('option', { value, text })));
  #timeRow = h('label', {}, 'For', this.#time);
  #fault = h('p', { class: 'note bad', role: 'alert', hidden: true });
  #send = h('button', { type: 'submit', id: 'alarm-send' });
  #form = h('form', { class: 'stack', id: 'alarm-form' }, h('label', {}, 'Comment', this.#comment), this.#timeRow, authorField(), this.#fault,
    h('div', { class: 'pager' }, h('button', { type: 'button', text: 'Cancel', onClick: () => this.element.close() }), this.#send));
  element = h('dialog', { id: 'alarm-dialog', 'aria-labelledby': 'alarm-dialog-title' }, this.#title, this.#what, this.#form);

  /** @param {string} session */
  constructor(session) {
    this.#session = session;
    this.#form.addEventListener('submit', (event) => {
      event.preventDefault();
      void this.#submit();
    });
  }

  /** @param {Act} act @param {Alarm[]} alarms those that allow it */
  ask(act, alarms) {
    if (!alarms.length) return;
    [this.#act, this.#alarms] = [act, alarms];
    const named = alarms.slice(0, MOST_NAMED).map(nameOf).join('; ');
    setText(this.#title, alarms.length > 1 ? `${ACT_WORDS[act]}: ${alarms.length} alarms` : ACT_WORDS[act]);
    setText(this.#what, alarms.length > MOST_NAMED ? `${named} and ${alarms.length - MOST_NAMED} more` : named);
    setText(this.#send, ACT_WORDS[act]);
    this.#comment.value = '';
    this.#timeRow.hidden = act !== 'shelve';
    this.#fault.hidden = true;
    this.element.showModal();
    this.#comment.focus();
  }

  async #submit() {
    const forS = this.#act === 'shelve' && this.#time.value ? { for_s: Number(this.#time.value) } : {};
    const body = { comment: this.#comment.value.trim(), by: authorOf(this.#form), ...forS };
    this.#send.disabled = true;
    try {
      const refused = (await actOnAlarms(this.#session, this.#act, this.#alarms.map(({ id }) => id), body)).filter(({ status }) => status !== 200);
      if (!refused.length) return this.element.close();
      const rest = refused.length < this.#alarms.length ? ' The others were done.' : '';
      this.#say(`${refused.length} of ${this.#alarms.length} refused: ${refused[0].detail}${rest}`);
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      this.#say(error.message);
    } finally {
      this.#send.disabled = false;
    }
  }

  /** @param {string} text */
  #say(text) {
    setText(this.#fault, text);
    this.#fault.hidden = false;
  }
}
