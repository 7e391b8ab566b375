// @ts-check
/** What people wrote on this inspection, for those who come after: of a place, a moment, a rod, or all of it. */

import { Problem, closeNote, writeNote } from '../api/client.js';
import * as format from '../state/format.js';
import { aboutOf, noteOf, openFirst } from '../state/notes.js';
import { authorField, authorOf } from './author.js';
import { h, setText } from './dom.js';
import { Fault } from './pagekit.js';

/** @typedef {{session: string, middle: () => {xM: number, yM: number} | null, moment: () => number | null, go: (note: Note) => void}} Uses */

const MOST = 50;

export class Notes {
  #uses;
  #shown = '';
  #title = h('h2');
  #list = h('ul', { class: 'said', id: 'notes' });
  #text = h('textarea', { name: 'text', required: true, maxlength: '2000', rows: '2' });
  #about = h('select', { name: 'about' }, ...[['all', 'the whole inspection'], ['place', 'the middle of the map'], ['moment', 'the moment that is shown']].map(([value, text]) => h('option', { value, text })));
  #fault = new Fault();
  #form = h('form', { class: 'stack', id: 'write-form' }, h('label', {}, 'Note', this.#text), h('label', {}, 'About', this.#about), authorField(), h('button', { type: 'submit', text: 'Keep the note' }));
  #fold = h('details', {}, h('summary', { text: 'Write a note for the next shift' }), this.#form);
  element = h('section', { id: 'notes-panel' }, this.#title, this.#list, this.#fault.element, this.#fold);

  /** @param {Uses} uses */
  constructor(uses) {
    this.#uses = uses;
    this.#form.addEventListener('submit', (event) => {
      event.preventDefault();
      void this.#fault.tell(() => this.#write());
    });
  }

  /** Begin to write. */
  open() {
    this.#fold.open = true;
    this.element.scrollIntoView();
    this.#text.focus();
  }

  /** @param {Iterable<Note>} notes */
  update(notes) {
    const all = openFirst(notes);
    const now = JSON.stringify(all);
    if (now === this.#shown) return;
    this.#shown = now;
    setText(this.#title, all.length ? `Notes · ${all.filter(({ closed_at: closed }) => !closed).length} open` : 'No notes');
    this.#list.replaceChildren(...all.slice(0, MOST).map((note) => this.#line(note)));
  }

  /** @param {Note} note */
  #line(note) {
    const about = aboutOf(note, format.moment);
    const isDone = Boolean(note.closed_at);
    return h('li', { 'data-closed': String(isDone) }, h('span', { text: note.text }),
      about && h('button', { type: 'button', class: 'plain', text: about, onClick: () => this.#uses.go(note) }),
      h('span', { class: 'quiet', text: `${note.by}, ${format.moment(note.at)}${isDone ? `; closed by ${note.closed_by}` : ''}` }),
      !isDone && h('button', { type: 'button', 'aria-label': `Close: ${note.text.slice(0, 60)}`, text: 'Dealt with', onClick: () => void this.#fault.tell(() => this.#close(note)) }));
  }

  async #write() {
    const said = noteOf(this.#text.value, this.#about.value, { middle: this.#uses.middle(), moment: this.#uses.moment() });
    await writeNote(this.#uses.session, { ...said, by: authorOf(this.#form) });
    this.#form.reset();
    this.#fold.open = false;
  }

  /** By whoever sits here; without a name it is asked for. @param {Note} note */
  async #close({ id }) {
    const field = /** @type {HTMLInputElement} */ (this.#form.elements.namedItem('by'));
    if (field.value.trim()) return void await closeNote(this.#uses.session, id, authorOf(this.#form));
    this.#fold.open = true;
    field.focus();
    throw new Problem('Write your name below first: it is kept with what you do.', 0);
  }
}
