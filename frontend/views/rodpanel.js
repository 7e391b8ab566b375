// @ts-check
/** Why a rod says what it says: its reading, and the snapshots behind it. */

import { Problem, getRod, snapshotUrl } from '../api/client.js';
import { Symbols } from '../map/symbols.js';
import { behindThen, behindWords, shortDigest } from '../state/behind.js';
import * as format from '../state/format.js';
import { fillOf, machineVerdictOf, verdictOf, wordOf } from '../state/rods.js';
import { keyOf } from '../state/snapshotkey.js';
import { h } from './dom.js';
import { ring } from './ring.js';
import { RodRecord } from './rodrecord.js';
import { rodPalette } from './theme.js';

const MOST_SHOWN = 24;

export class RodPanel extends EventTarget {
  #facts;
  #session;
  /** @type {RodLayout | null} */ #layout = null;
  #asked = 0;
  /** @type {string | null} */ #rodId = null;
  /** @type {Evidence | null} */ #chosen = null;
  /** As the server told it last. @type {RodFacts | null} */ #told = null;
  /** What of it is listed, and how many looks it was asked for. */ #listed = '';
  #askedViews = -1;
  #shown;
  #reading = h('div', { id: 'rod-reading' });
  #evidence = h('section');
  /** Of the chosen snapshot, in figures. */ #poses = h('div', { id: 'evidence-poses', role: 'status' });

  #record;

  /** @param {() => SessionFacts} facts of the inspection @param {() => import('../state/inspection.js').Inspection} shown as the page shows it */
  constructor(facts, shown) {
    super();
    this.#facts = facts;
    this.#shown = shown;
    this.#session = facts().id;
    this.#record = new RodRecord(facts);
    this.element = h('section', { id: 'rod-panel', 'aria-label': 'Rod', hidden: true });
  }

  get rodId() { return this.#rodId; }
  /** The snapshot whose outlines the map shows. */
  get chosen() { return this.#chosen; }

  /** @param {RodRow} rod as the feed has it @param {RodLayout} layout */
  async open(rod, layout) {
    this.#rodId = rod.rod_id;
    this.#layout = layout;
    this.#listed = '';
    this.#chosen = this.#told = null;
    this.#poses.replaceChildren();
    this.#askedViews = rod.views;
    const close = h('button', { type: 'button', 'aria-label': 'Close', title: 'Close (Esc)', text: '✕', onClick: () => this.close() });
    this.#evidence.replaceChildren(h('p', { class: 'quiet', text: 'Loading the snapshots…' }));
    this.element.replaceChildren(h('div', { class: 'panel-head' }, h('h2', { text: `Rod ${rod.rod_id}` }), close), this.#reading, this.#evidence, this.#record.element);
    this.element.hidden = false;
    this.show(rod, layout);
    await Promise.all([this.#load(rod.rod_id), this.#record.open(rod.rod_id)]);
  }

  close() {
    this.#rodId = this.#chosen = null;
    this.element.hidden = true;
    this.dispatchEvent(new Event('close'));
  }

  /** The reading as it stands. @param {RodRow} rod @param {RodLayout} layout */
  show(rod, layout) {
    const verdict = verdictOf(rod);
    const share = fillOf(rod);
    const fill = share === null ? '' : ` ${format.percent(share)}`;
    const word = `${wordOf(verdict)}${verdict === 'partial' ? fill : ''}${rod.by_hand ? ' · by hand' : ''}`;
    const machine = machineVerdictOf(rod);
    const rows = {
      ...(rod.by_hand ? { 'By hand': `${rod.by_hand.by}: ${rod.by_hand.reason}`, 'Machine reads': wordOf(machine) } : {}),
      Fill: format.percent(rod.fill, 1), Confidence: machine === 'unseen' ? format.NONE : format.percent(rod.confidence, 1),
      Looks: format.count(rod.views), Place: format.place(layout.x_m, layout.y_m),
    };
    this.#reading.replaceChildren(
      h('p', { class: 'verdict', id: 'rod-verdict' }, new Symbols(rodPalette()).of(rod, 15), h('span', { text: word })),
      facts(rows));
    this.#record.update(rod);
    this.#follow(rod);
  }

  /** The snapshots of another moment; and those that came since, once the rod has more looks. @param {RodRow} rod */
  #follow(rod) {
    if (this.#told) this.#showEvidence(this.#told);
    if (this.#shown().heldAtMs != null || rod.views === this.#askedViews) return;
    this.#askedViews = rod.views;
    void this.#load(rod.rod_id);
  }

  /** @param {string} rodId */
  async #load(rodId) {
    const asked = ++this.#asked;
    try {
      const rod = await getRod(this.#session, rodId);
      if (asked !== this.#asked) return;
      this.#told = rod;
      this.#showEvidence(rod);
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      if (asked !== this.#asked) return;
      [this.#listed, this.#told] = ['', null];
      this.#evidence.replaceChildren(h('p', { class: 'note bad', role: 'alert', text: error.message }));
    }
  }

  /** @param {RodFacts} rod */
  #showEvidence(rod) {
    const snapshots = behindThen(rod.snapshots, this.#shown());
    const isPast = this.#shown().heldAtMs != null;
    const listed = JSON.stringify([isPast, Boolean(this.#facts().camera), ...snapshots.map((one) => [keyOf(one), one.status, one.corrected, one.fill])]);
    if (listed === this.#listed) return;
    this.#listed = listed;
    const shown = snapshots.slice(0, MOST_SHOWN);
    const more = snapshots.length - shown.length;
    const pictures = shown.map((snapshot) => this.#picture(snapshot));
    const held = /** @type {HTMLElement | null} */ (this.#evidence.contains(document.activeElement) ? document.activeElement : null)?.dataset.key;
    if (this.#chosen && !snapshots.some((one) => this.#isChosen(one))) this.#forget();
    this.#evidence.replaceChildren(
      h('h2', { text: behindWords(snapshots.length, isPast) }),
      snapshots.length > 0 && h('p', { class: 'quiet small', text: 'Ring: the rod by the corrected pose; dashed: by the pose that came.' }) || '',
      h('div', { class: 'evidence' }, ...pictures), this.#poses,
      more > 0 && h('p', { class: 'quiet', text: `and ${more} more` }) || '',
      facts({ Method: rod.method ?? format.NONE, ...digestsOf(rod) }));
    if (held) pictures.find(({ dataset }) => dataset.key === held)?.focus();
  }

  #forget() {
    this.#chosen = null;
    this.#poses.replaceChildren();
    this.dispatchEvent(new Event('choose'));
  }

  /** @param {Evidence} snapshot */
  #picture(snapshot) {
    const name = `${snapshot.robot} #${snapshot.sequence}`;
    const button = h('button', { type: 'button', 'data-key': keyOf(snapshot), 'aria-pressed': String(this.#isChosen(snapshot)), title: 'Show where it was said to be, and where it is',
      onClick: () => this.#choose(snapshot, button) },
      h('span', { class: 'picture' }, h('img', { src: snapshotUrl(this.#session, snapshot), alt: `Snapshot ${name}`, loading: 'lazy' }), ...this.#rings(snapshot)),
      h('span', { text: name }), h('span', { class: 'quiet', text: evidenceLine(snapshot) }));
    return button;
  }

  /** Where the rod is in the picture: by the corrected pose, and (dashed) by the pose that came. @param {Evidence} snapshot */
  #rings({ raw, corrected }) {
    const { camera } = this.#facts();
    const rod = this.#layout;
    if (!camera || !rod) return [];
    return [ring(raw, camera, rod, 'raw'), corrected && ring(corrected, camera, rod, 'corrected')];
  }

  /** @param {Evidence} snapshot */
  #isChosen(snapshot) { return this.#chosen !== null && keyOf(this.#chosen) === keyOf(snapshot); }

  /** @param {Evidence} snapshot @param {HTMLElement} button */
  #choose(snapshot, button) {
    const again = this.#isChosen(snapshot);
    for (const other of this.#evidence.querySelectorAll('button')) other.setAttribute('aria-pressed', 'false');
    button.setAttribute('aria-pressed', String(!again));
    if (again) return this.#forget();
    this.#chosen = snapshot;
    this.#poses.replaceChildren(facts(posesOf(snapshot)));
    this.dispatchEvent(new Event('choose'));
  }
}

/** @param {Evidence} snapshot */
function evidenceLine({ raw, corrected, status, fill }) {
  const moved = corrected ? `moved ${format.length(Math.hypot(corrected.x_m - raw.x_m, corrected.y_m - raw.y_m))}` : 'not placed';
  const reads = fill == null ? '' : `reads ${format.percent(fill)}, `;
  return `${reads}${status === 'uncertain' ? 'uncertain, ' : ''}${moved}`;
}

/** @param {Evidence} snapshot @returns {Record<string, string>} */
function posesOf({ raw, corrected }) {
  const said = (/** @type {PlanePose} */ { x_m, y_m, theta_rad }) => `${format.place(x_m, y_m, ', ')}, ${format.angle(theta_rad)}`;
  return { 'Pose that came': said(raw), Corrected: corrected ? said(corrected) : 'not placed' };
}

/** By what it was read; in full in the evidence and from the API. @param {RodFacts} rod @returns {Record<string, string>} */
function digestsOf({ method_digest: method, model_digest: model }) {
  return { ...(method ? { 'Method digest': shortDigest(method) } : {}), ...(model ? { 'Model digest': shortDigest(model) } : {}) };
}

/** @param {Record<string, string>} rows */
function facts(rows) {
  const entries = Object.entries(rows).flatMap(([term, value]) => [h('dt', { text: term }), h('dd', { text: value })]);
  return h('dl', { class: 'facts' }, ...entries);
}
