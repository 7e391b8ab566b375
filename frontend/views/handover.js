// @ts-check
/** What the next shift should know, of all inspections: open notes, and what was noted or judged by hand lately. */

import { Problem, handover } from '../api/client.js';
import { format as addressOf } from '../state/address.js';
import * as format from '../state/format.js';
import { aboutOf, openFirst } from '../state/notes.js';
import { wordOf } from '../state/rods.js';
import { h, setText } from './dom.js';

const HOURS = 12;
const EVERY_MS = 15_000;

export class Handover {
  #list = h('ul', { class: 'said' });
  #empty = h('p', { class: 'quiet' });
  element = h('section', { id: 'handover', hidden: true }, h('h2', { text: 'For the next shift' }), this.#empty, this.#list);

  start() { void this.#load(); }

  async #load() {
    try {
      const { notes, judgements } = await handover(HOURS);
      this.element.hidden = false;
      setText(this.#empty, notes.length || judgements.length ? '' : `No note is open, and no rod was judged by hand in the last ${HOURS} hours.`);
      this.#list.replaceChildren(...openFirst(notes).map((note) => noteLine(/** @type {any} */ (note))), ...judgements.map(judgementLine));
    } catch (error) {
      if (!(error instanceof Problem)) throw error; // the page says by itself that the server is gone
    }
    setTimeout(() => void this.#load(), EVERY_MS);
  }
}

/** @param {Note & {session: string, session_name: string}} note */
function noteLine(note) {
  const done = note.closed_at ? `; closed by ${note.closed_by}` : '';
  return line(note.text, note.session, note.session_name, note.rod_id, [aboutOf(note, format.moment), `${note.by}, ${format.moment(note.at)}${done}`], Boolean(done));
}

/** @param {Judgement & {rod_id: string, session: string, session_name: string}} said */
function judgementLine({ state, reason, by, at, rod_id: rod, session, session_name: name }) {
  const word = state ? `${wordOf(state)} by hand` : 'The machine is right after all';
  return line(`${word}: ${reason}`, session, name, rod, [`Rod ${rod}`, `${by}, ${format.moment(at)}`], false);
}

/** @param {string} text @param {string} session @param {string} name @param {string | null} rod @param {string[]} more @param {boolean} done */
function line(text, session, name, rod, more, done) {
  return h('li', { 'data-closed': String(done) }, h('span', { text }), h('span', { class: 'quiet' }, h('a', { href: addressOf({ session, rod }), text: name }), ` · ${more.filter(Boolean).join(' · ')}`));
}
