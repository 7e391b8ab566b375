// @ts-check
/** Which two inspections are compared: what they are, whether they still run, and others to choose. */

import { getPond } from '../api/ponds.js';
import { pageOfSessions } from '../api/client.js';
import { format as addressOf } from '../state/address.js';
import * as format from '../state/format.js';
import { isRunning } from '../state/robots.js';
import { h } from './dom.js';

/** @typedef {import('../state/comparison.js').SideName} SideName */

const WORDS = { base: 'Before', with: 'After' };

export class CompareHead {
  #choose;
  #boxes = { base: h('div', { class: 'pair-side' }), with: h('div', { class: 'pair-side after' }) };
  #swap = h('button', { type: 'button', id: 'swap', title: 'Swap before and after (S)', 'aria-label': 'Swap before and after', text: '⇄' });
  element = h('section', { class: 'pair', 'aria-label': 'The two inspections' }, this.#boxes.base, this.#swap, this.#boxes.with);

  /** @param {(side: SideName, session: string) => void} choose @param {() => void} swap */
  constructor(choose, swap) {
    this.#choose = choose;
    this.#swap.addEventListener('click', swap);
  }

  /** @param {SideName} side @param {SessionFacts | null} facts */
  show(side, facts) {
    const select = h('select', { id: `pair-${side}`, 'aria-label': `${WORDS[side]}: another inspection`, onChange: () => select.value && this.#choose(side, select.value) },
      h('option', { value: facts?.id ?? '', text: facts ? facts.name || facts.id : 'Choose an inspection…' }));
    this.#boxes[side].replaceChildren(h('span', { class: 'badge when', text: WORDS[side] }), select, ...(facts ? about(facts) : []));
  }

  /** Others of the same pond to choose from; all, where the pond is not known. @param {string | null | undefined} pond */
  async offer(pond) {
    const found = pond ? (await getPond(pond)).inspections : (await pageOfSessions({ limit: 100 })).sessions;
    for (const box of Object.values(this.#boxes)) {
      const select = /** @type {HTMLSelectElement} */ (box.querySelector('select'));
      const others = found.filter(({ id }) => id !== select.value);
      select.append(...others.map(({ id, name, created_at: at, state }) => h('option', { value: id, text: `${name || id} · ${format.moment(at)}${isRunning(state) ? ' · running' : ''}` })));
    }
  }
}

/** @param {SessionFacts} facts */
function about({ id, state, created_at: at, finished_at: end, coverage, revision }) {
  const running = isRunning(state);
  const times = running ? `started ${format.moment(at)}` : `finished ${format.moment(end ?? at)}`;
  return [h('span', { class: running ? 'badge running' : 'badge', text: running ? `RUNNING · as of revision ${revision}` : state }),
    h('span', { class: 'quiet times', text: times }), h('span', { class: 'coverage', text: `coverage ${format.percent(coverage)}` }),
    h('a', { href: addressOf({ session: id }), text: 'Open' })];
}
