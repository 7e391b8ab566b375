// @ts-check
/** What the compare page is asked to show, as its address; and the changed rods in the order asked for. No DOM. */

import { readView, writeView } from './address.js';

export const MODES = /** @type {const} */ (['side', 'swipe', 'blink', 'opacity', 'difference']);
export const SORTS = /** @type {const} */ (['change', 'rod', 'confidence', 'residual']);
export const SHOWN = /** @type {const} */ (['changes', 'rods', 'grid']);
/** In the order of a legend. The mark says the change without its colour. */
export const CHANGES = /** @type {const} */ ([
  { change: 'filled', word: 'Filled', mark: '▲' }, { change: 'emptied', word: 'Emptied', mark: '▼' },
  { change: 'partly', word: 'Partly', mark: '◐' }, { change: 'not_comparable', word: 'Not comparable', mark: '?' },
]);

/** @typedef {typeof MODES[number]} Mode */
/** @typedef {typeof SORTS[number]} Sort */
/** @typedef {typeof SHOWN[number]} Shown */
/** @typedef {'base' | 'with'} SideName */

const EVERY = CHANGES.map(({ change }) => String(change));
const STEP = 0.05;

export class CompareOptions extends EventTarget {
  /** Ids; `last` is the finished inspection before the other. */ base = '';
  with = '';
  /** @type {Mode} */ mode = 'side';
  /** Which of the two is in front, where one is. @type {SideName} */ front = 'with';
  /** Where the swipe stands, and how much of the later shows through: 0 to 1. */ at = 0.5;
  /** The map's middle and scale; the whole pond where null. @type {import('./address.js').MapView | null} */ place = null;
  /** @type {string | null} */ rod = null;
  /** Changes that are listed. @type {Set<string>} */ only = new Set(EVERY);
  /** @type {Sort} */ sort = 'change';
  descending = false;
  /** @type {Record<Shown, boolean>} */ shown = { changes: true, rods: false, grid: false };

  /** @param {Partial<CompareOptions>} change */
  set(change) {
    Object.assign(this, change);
    this.dispatchEvent(new Event('change'));
  }

  /** Before or after: the other of the two, alone. */
  flip() { this.set({ mode: 'blink', front: this.front === 'with' ? 'base' : 'with' }); }

  /** @param {number} steps to the right, or to the left */
  slide(steps) { this.set({ at: Math.round(Math.min(1, Math.max(0, this.at + steps * STEP)) * 100) / 100 }); }

  /** @param {string} change */
  toggleOnly(change) {
    const only = new Set(this.only);
    if (!only.delete(change)) only.add(change);
    this.set({ only });
  }

  /** @param {Shown} name */
  toggle(name) { this.set({ shown: { ...this.shown, [name]: !this.shown[name] } }); }

  /** The page's address. */
  get address() {
    const query = new URLSearchParams({ compare: [this.base, this.with].filter(Boolean).join(',') });
    const { mode, front, at, place, rod, sort, descending } = this;
    if (mode !== 'side') query.set('mode', mode);
    if (front !== 'with') query.set('front', front);
    if (at !== 0.5) query.set('at', String(at));
    if (place) query.set('view', writeView(place));
    if (rod) query.set('rod', rod);
    if (this.only.size < EVERY.length) query.set('only', EVERY.filter((change) => this.only.has(change)).join(','));
    if (sort !== 'change') query.set('sort', sort);
    if (descending) query.set('order', 'desc');
    const words = SHOWN.filter((name) => this.shown[name] !== (name === 'changes')).map((name) => (this.shown[name] ? name : `-${name}`));
    if (words.length) query.set('show', words.join(','));
    return `/?${query.toString().replaceAll('%2C', ',')}`;
  }

  /** Take what an address says; what is not known is passed over. @param {string} search */
  read(search) {
    const query = new URLSearchParams(search);
    [this.base = '', this.with = ''] = (query.get('compare') ?? '').split(',');
    this.mode = MODES.find((mode) => mode === query.get('mode')) ?? 'side';
    this.front = query.get('front') === 'base' ? 'base' : 'with';
    this.sort = SORTS.find((sort) => sort === query.get('sort')) ?? 'change';
    this.descending = query.get('order') === 'desc';
    this.rod = query.get('rod');
    const at = Number(query.get('at') ?? 0.5);
    this.at = at >= 0 && at <= 1 ? at : 0.5;
    this.place = readView(query.get('view'));
    const only = query.get('only');
    if (only !== null) this.only = new Set(EVERY.filter((change) => only.split(',').includes(change)));
    for (const word of (query.get('show') ?? '').split(',')) {
      const name = SHOWN.find((one) => one === word.replace(/^-/, ''));
      if (name) this.shown[name] = name === word;
    }
    return this;
  }
}

/** @param {string} base @param {string} later */
export function compareAddress(base, later) {
  return Object.assign(new CompareOptions(), { base, with: later }).address;
}

/** The rods that are listed, in the order asked for. @param {CompareAnswer} answer @param {CompareOptions} options */
export function listed(answer, { only, sort, descending }) {
  const rods = [...answer.rods, ...answer.not_comparable].filter(({ change }) => only.has(change));
  const ordered = rods.sort((a, b) => ORDERS[sort](a, b) || byName(a, b));
  return descending ? ordered.reverse() : ordered;
}

/** @param {RodChange} a @param {RodChange} b */
const byName = (a, b) => a.rod_id.localeCompare(b.rod_id, 'en', { numeric: true });
/** @type {Record<Sort, (a: RodChange, b: RodChange) => number>} */
const ORDERS = {
  change: (a, b) => EVERY.indexOf(a.change) - EVERY.indexOf(b.change),
  rod: byName,
  confidence: (a, b) => a.confidence - b.confidence,
  residual: (a, b) => (a.residual_px ?? -1) - (b.residual_px ?? -1),
};

/** @param {string} change */
export function changeOf(change) {
  return CHANGES.find((one) => one.change === change) ?? { change, word: 'Same', mark: '=' };
}

/** Why nothing is claimed of a rod, for a person. @type {Record<string, string>} */
export const REASONS = {
  not_observed: 'observed in neither', not_observed_base: 'not observed before', not_observed_with: 'not observed after',
  elsewhere: 'the two layouts put it at different places', residual: 'the mosaics do not coincide here',
  unmeasured: 'the readings differ, and whether the mosaics coincide here is not known', unsure: 'the readings differ, and one of them is not sure', withheld: 'the whole comparison is refused',
};

/** What a robot would have done to it, for a person. @param {RodChange} rod */
export function wordsOf({ word, counterpart, change }) {
  if (word === 'moved') return change === 'emptied' ? `removed; may have moved to ${counterpart}` : `added; may have moved from ${counterpart}`;
  return word ?? '';
}
