// @ts-check
/** What the finished inspection found on the floor and of rods off their place: a list, each with its picture; a click leads there. */

import { Problem, findingsOf, findingUrl } from '../api/client.js';
import * as format from '../state/format.js';
import { h, setText } from './dom.js';

/** @typedef {import('../api/client.js').Finding} Finding */

const WORDS = { 'foreign-object': 'Foreign object', stain: 'Stain', 'rod-displaced': 'Rod displaced' };

export class Findings {
  #session;
  #go;
  #title = h('h2', { id: 'findings-title' });
  #note = h('p', { id: 'findings-note' });
  #list = h('ul', { class: 'findings', id: 'findings-list' });
  #asked = false;
  element = h('section', { id: 'findings', hidden: true, 'aria-labelledby': 'findings-title' }, this.#title, this.#note, this.#list);

  /** @param {string} session @param {(finding: Finding) => void} go */
  constructor(session, go) {
    this.#session = session;
    this.#go = go;
  }

  /** Ask once it is finished: before, nothing is known. @param {string | undefined} state */
  async update(state) {
    if (this.#asked || state !== 'finished') return;
    this.#asked = true;
    try {
      const { findings, examined, looked } = await findingsOf(this.#session);
      if (looked) this.#draw(findings, examined);
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      this.#asked = false; // the next revision asks again
    }
  }

  /** @param {Finding[]} findings @param {number} examined */
  #draw(findings, examined) {
    setText(this.#title, `Findings: ${findings.length || 'none'}`);
    setText(this.#note, `${format.percent(examined)} of the floor was seen by three snapshots or more and looked over.`);
    this.#list.replaceChildren(...findings.map((finding) => this.#line(finding)));
    this.element.hidden = false;
  }

  /** @param {Finding} finding */
  #line(finding) {
    const picture = h('img', { src: findingUrl(this.#session, finding.number), alt: '', loading: 'lazy', width: '56', height: '56' });
    const words = h('span', {}, h('strong', { text: `${finding.number} ${WORDS[finding.kind]}` }), h('span', { text: detailOf(finding) }));
    return h('li', {}, h('button', { type: 'button', class: 'finding', title: 'Show it on the map', onClick: () => this.#go(finding) }, picture, words));
  }
}

/** @param {Finding} f */
export function detailOf(f) {
  const where = format.place(f.x_m, f.y_m, ', ');
  const what = f.kind === 'rod-displaced'
    ? `${f.rod_id} by ${format.fixed(Math.hypot(f.offset_x_mm ?? 0, f.offset_y_mm ?? 0), 2)} ±\u00a0${format.figure(f.sigma_mm ?? 0, 2, 'mm')}`
    : `${format.figure(f.size_mm, 1, 'mm')}, near ${f.rod_id}, ${f.agreeing} of ${f.looks} looks`;
  return `${what}; ${where}; confidence ${format.percent(f.confidence)}`;
}
