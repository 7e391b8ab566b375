// @ts-check
/** One rod of two inspections: what each reads, with the pictures before and after, and its past. */

import { Problem, getRod, snapshotUrl } from '../api/client.js';
import { getRodHistory, rodPictureUrl } from '../api/ponds.js';
import { format as addressOf } from '../state/address.js';
import { REASONS, changeOf, wordsOf } from '../state/comparison.js';
import * as format from '../state/format.js';
import { reading } from './changelist.js';
import { h } from './dom.js';
import { pastStrip } from './paststrip.js';
import { ring } from './ring.js';

const MOST_SNAPSHOTS = 6;

export class ChangeDetail extends EventTarget {
  #asked = 0;
  #body = h('div', { class: 'side-part' });
  #title = h('h2', { id: 'rod-title', tabindex: '-1' });
  element = h('section', { id: 'rod-panel', 'aria-labelledby': 'rod-title', hidden: true }, h('div', { class: 'panel-head' }, this.#title,
    this.#step('previous', '‹', 'Rod before in the list (P)'), this.#step('next', '›', 'Next rod of the list (N)'), this.#step('close', '✕', 'Close (Esc)')), this.#body);
  /** @type {string | null} */ #shown = null;

  /** @param {string} type @param {string} text @param {string} title */
  #step(type, text, title) {
    return h('button', { type: 'button', id: `rod-${type}`, title, 'aria-label': title, text, onClick: () => this.dispatchEvent(new Event(type)) });
  }

  /** @param {string | null} id @param {RodChange | undefined} rod undefined: the same in both @param {CompareAnswer} answer */
  show(id, rod, answer) {
    if (id === this.#shown) return;
    this.#shown = id;
    this.element.hidden = id === null;
    if (id === null) return;
    this.#title.textContent = `${id} · ${rod ? changeOf(rod.change).word : 'No difference'}`;
    const [pictures, past] = [h('div', { class: 'before-after' }), h('div', { id: 'rod-past' })];
    const claims = rod ? facts(claimsOf(rod)) : '';
    this.#body.replaceChildren(claims, pictures, past);
    const asked = ++this.#asked;
    void this.#load(pictures, asked, async () => (await Promise.all([evidenceOf('Before', answer.base, id), evidenceOf('After', answer.with, id)])));
    const pond = answer.with.pond_id;
    if (pond) void this.#load(past, asked, async () => [h('h2', { text: 'In all inspections of this pond' }), pastStrip(await getRodHistory(pond, id), id, { [answer.base.session]: 'before', [answer.with.session]: 'after' })]);
  }

  /** @param {HTMLElement} into @param {number} asked @param {() => Promise<Node[]>} make */
  async #load(into, asked, make) {
    try {
      const made = await make();
      if (asked === this.#asked) into.replaceChildren(...made);
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      if (asked === this.#asked) into.replaceChildren(h('p', { class: 'note bad', role: 'alert', text: error.message }));
    }
  }
}

/** @param {RodChange} rod @returns {Record<string, string>} */
function claimsOf(rod) {
  const residual = rod.residual_px === null ? 'not measured here' : `${format.figure(rod.residual_px, 2, 'px')}, ${format.figure(rod.residual_mm ?? NaN, 3, 'mm')}`;
  if (rod.change === 'not_comparable') return { Why: REASONS[rod.reason ?? ''] ?? '', 'Residual here': residual };
  return { Confidence: `${format.percent(rod.confidence, 1)} that both readings are right`, 'It differs': `${format.percent(rod.p_changed, 2)} sure`,
    ...(rod.word ? { 'It was': wordsOf(rod) } : {}), 'Residual here': residual };
}

/** @param {string} title @param {{session: string, name: string}} side @param {string} id */
export async function evidenceOf(title, side, id) {
  const rod = await getRod(side.session, id).catch((error) => { if (error.status === 404) return null; throw error; });
  const link = h('a', { href: addressOf({ session: side.session, rod: id }), text: 'Open there', title: `The rod in ${side.name}` });
  if (!rod) return h('div', {}, h('h3', { text: title }), h('p', { class: 'quiet', text: 'The layout of this inspection has no such rod.' }));
  const unseen = rod.views === 0 || rod.state === 'unseen';
  const says = unseen ? 'not observed' : `${reading({ ...rod, conflicting: Boolean(rod.conflicting) })} · ${format.percent(rod.confidence, 1)}`;
  const shown = rod.snapshots.slice(0, MOST_SNAPSHOTS).map((snapshot) => picture(snapshotUrl(side.session, snapshot), `${snapshot.robot} #${snapshot.sequence}`, `Snapshot ${title.toLowerCase()}`, ringIn(snapshot, rod)));
  const rest = rod.snapshots.length - shown.length;
  return h('div', {}, h('h3', { text: title }), h('p', { class: 'says', text: says }), picture(rodPictureUrl(side.session, id), 'mosaic', `Rod ${id} in the mosaic ${title.toLowerCase()}`),
    h('h4', { text: rod.snapshots.length ? `Snapshots · ${rod.snapshots.length}` : 'No snapshot shows it' }), ...shown,
    h('p', { class: 'quiet' }, rest > 0 ? `and ${rest} more · ` : '', link));
}

/** Which of the rods in a snapshot it is. @param {Evidence} snapshot @param {RodFacts} rod */
function ringIn({ corrected }, { camera, place }) {
  return corrected && camera && place ? ring(corrected, camera, place, 'corrected') : '';
}

/** @param {string} src @param {string} text @param {string} alt @param {Node | ''} [mark] over the picture */
function picture(src, text, alt, mark = '') {
  return h('figure', {}, h('a', { href: src, target: '_blank', rel: 'noopener', title: 'In full size, in a tab of its own' }, h('span', { class: 'picture' }, h('img', { src, alt: `${alt}: ${text}`, loading: 'lazy' }), mark)), h('figcaption', { text }));
}

/** @param {Record<string, string>} rows */
function facts(rows) {
  return h('dl', { class: 'facts' }, ...Object.entries(rows).flatMap(([term, value]) => [h('dt', { text: term }), h('dd', { text: value })]));
}
