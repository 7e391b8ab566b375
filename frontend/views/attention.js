// @ts-check
/** What needs attention, at the top of the side panel; each line leads to where it is. */

import { h, setText } from './dom.js';

/** @typedef {import('../state/attention.js').Note} Note */

export class Attention {
  #title = h('h2', { id: 'attention-title' });
  #list = h('ul', { class: 'attention-list' });
  #shown = '';
  #go;
  element = h('section', { id: 'attention', 'aria-labelledby': 'attention-title' }, this.#title, this.#list);

  /** @param {(note: Note) => void} go */
  constructor(go) {
    this.#go = go;
  }

  /** @param {Note[]} notes */
  update(notes) {
    setText(this.#title, notes.length ? `Needs attention · ${notes.length}` : 'Nothing needs attention');
    const now = notes.map(({ kind, rod, robot }) => `${kind}/${rod}/${robot}`).join();
    if (now !== this.#shown) this.#list.replaceChildren(...notes.map((note) => this.#line(note)));
    this.#shown = now;
    notes.forEach(({ text, advice }, i) => {
      const [line, more] = /** @type {Element} */ (this.#list.children[i].firstElementChild).children;
      setText(line, text);
      setText(more, advice);
    });
    this.#notes = notes;
  }
  /** @type {Note[]} */ #notes = [];

  /** @param {Note} note */
  #line(note) {
    const { kind, rod, robot } = note;
    const onClick = () => {
      const current = this.#notes.find((one) => one.kind === kind && one.rod === rod && one.robot === robot);
      if (current) this.#go(current);
    };
    return h('li', {}, h('button', { type: 'button', 'data-kind': kind, onClick }, h('strong'), h('span')));
  }
}
