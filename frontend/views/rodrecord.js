// @ts-check
/** What a rod read as before, here and in other inspections; what people say of it; notes on it. */

import { getOtherReadings, getRodRecord, judgeRod, writeNote } from '../api/client.js';
import { format as addressOf } from '../state/address.js';
import * as format from '../state/format.js';
import { machineVerdictOf, wordOf } from '../state/rods.js';
import { authorField, authorOf } from './author.js';
import { h } from './dom.js';
import { Fault } from './pagekit.js';

const MOST_ROWS = 30;

export class RodRecord {
  #facts;
  #rodId = '';
  #asked = 0;
  #seen = '';
  #history = h('section', { id: 'rod-history' });
  #others = h('section', { id: 'rod-others' });
  #said = h('section', { id: 'rod-said' });
  #fault = new Fault();
  #judge = judgementForm((form) => this.#send(form, (by) => judgeRod(this.#facts().id, this.#rodId, judgementOf(form, by))));
  #note = noteForm((form) => this.#send(form, (by) => writeNote(this.#facts().id, { text: wordsOf(form, 'text'), by, rod_id: this.#rodId })));
  element = h('div', { class: 'side-part' }, this.#said, this.#fault.element, fold('Correct by hand', this.#judge), fold('Write a note', this.#note), this.#history, this.#others);

  /** @param {() => SessionFacts} facts */
  constructor(facts) {
    this.#facts = facts;
  }

  /** @param {string} rodId */
  async open(rodId) {
    this.#rodId = rodId;
    this.#seen = '';
    this.#fault.element.hidden = true;
    for (const form of [this.#judge, this.#note]) form.reset();
    for (const part of [this.#history, this.#others, this.#said]) part.replaceChildren();
    await Promise.all([this.load(), this.#loadOthers(rodId)]);
  }

  /** Load anew where the rod's row is otherwise than when it was last loaded. @param {RodRow} rod */
  update(rod) {
    const now = JSON.stringify([rod.state, rod.views, rod.by_hand?.at]);
    if (this.#seen && now !== this.#seen) void this.load();
    this.#seen = now;
  }

  async load() {
    const asked = ++this.#asked;
    await this.#fault.tell(async () => {
      const record = await getRodRecord(this.#facts().id, this.#rodId);
      if (asked === this.#asked) this.#show(record);
    });
  }

  /** @param {string} rodId */
  async #loadOthers(rodId) {
    await this.#fault.tell(async () => {
      const others = await getOtherReadings(this.#facts(), rodId);
      if (rodId !== this.#rodId) return;
      const rows = others.map(({ session, reading }) => [
        h('a', { href: addressOf({ session: session.id, rod: rodId }), text: session.name }), format.moment(session.created_at),
        words(machineVerdictOf(reading), reading.fill), String(reading.views)]);
      this.#others.replaceChildren(h('h2', { text: 'In other inspections' }), rows.length ? table(['Inspection', 'Started', 'Reading', 'Looks'], rows)
        : h('p', { class: 'quiet', text: 'There is no other inspection of this pond.' }));
    });
  }

  /** @param {RodStory} record */
  #show({ history, by_hand: judgements, notes }) {
    const rows = history.toReversed().slice(0, MOST_ROWS).map((one) => [format.moment(one.at),
      one.conflicting ? wordOf('conflicting') : words(one.state, one.fill), format.percent(one.confidence), String(one.views)]);
    this.#history.replaceChildren(h('h2', { text: `In this inspection · ${history.length} reading${history.length === 1 ? '' : 's'}` }), rows.length ? table(['At', 'Reading', 'Sure', 'Looks'], rows)
      : h('p', { class: 'quiet', text: 'No earlier reading is kept.' }));
    const said = [...judgements.map(judgementLine), ...notes.map(noteLine)];
    this.#said.replaceChildren(h('h2', { text: said.length ? 'What people say' : 'Nobody has said anything of it' }), h('ul', { class: 'said' }, ...said));
  }

  /** @param {HTMLFormElement} form @param {(by: string) => Promise<unknown>} send */
  async #send(form, send) {
    await this.#fault.tell(async () => {
      await send(authorOf(form));
      form.reset();
      form.closest('details')?.removeAttribute('open');
      await this.load();
    });
  }
}

/** @param {import('../state/rods.js').Verdict} verdict @param {number | null} fill */
function words(verdict, fill) {
  return verdict === 'partial' ? `${wordOf(verdict)} ${format.percent(fill)}` : wordOf(verdict);
}

/** @param {Judgement} said */
function judgementLine({ state, fill, reason, by, at, machine }) {
  const word = state ? `${words(state, fill)} by hand` : 'Taken back: the machine is right';
  const read = `machine then: ${words(/** @type {RodRow['state']} */ (machine.state), machine.fill)}, ${format.percent(machine.confidence)} sure`;
  return h('li', {}, h('strong', { text: word }), h('span', { text: reason }), h('span', { class: 'quiet', text: `${by}, ${format.moment(at)}; ${read}` }));
}

/** @param {Note} note */
function noteLine({ text, by, at, closed_by: closedBy }) {
  return h('li', {}, h('span', { text }), h('span', { class: 'quiet', text: `${by}, ${format.moment(at)}${closedBy ? `; closed by ${closedBy}` : ''}` }));
}

/** @param {string[]} heads @param {(string | Node)[][]} rows */
function table(heads, rows) {
  return h('table', { class: 'small' }, h('thead', {}, h('tr', {}, ...heads.map((text) => h('th', { scope: 'col', text })))),
    h('tbody', {}, ...rows.map((cells) => h('tr', {}, ...cells.map((cell) => h('td', {}, cell))))));
}

/** @param {string} title @param {HTMLFormElement} form */
function fold(title, form) {
  return h('details', {}, h('summary', { text: title }), form);
}

/** @param {(form: HTMLFormElement) => void} send */
function judgementForm(send) {
  const choices = [['full', 'Full'], ['partial', 'Partial'], ['empty', 'Empty'], ['', 'The machine is right after all']];
  const state = h('select', { name: 'state', onChange: () => follow() }, ...choices.map(([value, text]) => h('option', { value, text })));
  const fill = h('input', { name: 'fill', type: 'number', min: '5', max: '95', step: '1', value: '50' });
  const share = h('label', {}, 'Filled, %', fill);
  const follow = () => { share.hidden = fill.disabled = state.value !== 'partial'; };
  const reason = h('textarea', { name: 'reason', required: true, maxlength: '2000', rows: '2' });
  const form = formOf('judge', 'Correct', send, h('label', {}, 'It is', state), share, h('label', {}, 'Why', reason));
  form.addEventListener('reset', () => setTimeout(follow));
  follow();
  return form;
}

/** @param {HTMLFormElement} form @param {string} by */
function judgementOf(form, by) {
  const state = wordsOf(form, 'state') || null;
  return { state, ...(state === 'partial' ? { fill: Number(wordsOf(form, 'fill')) / 100 } : {}), reason: wordsOf(form, 'reason'), by };
}

/** @param {(form: HTMLFormElement) => void} send */
function noteForm(send) {
  return formOf('note', 'Keep the note', send, h('label', {}, 'Note', h('textarea', { name: 'text', required: true, maxlength: '2000', rows: '2' })));
}

/** @param {string} id @param {string} word @param {(form: HTMLFormElement) => void} send @param {...HTMLElement} fields */
function formOf(id, word, send, ...fields) {
  const form = h('form', { id: `${id}-form`, class: 'stack' }, ...fields, authorField(), h('button', { type: 'submit', text: word }));
  form.addEventListener('submit', (event) => {
    event.preventDefault();
    send(form);
  });
  return form;
}

/** @param {HTMLFormElement} form @param {string} name */
function wordsOf(form, name) {
  return String(new FormData(form).get(name) ?? '').trim();
}
