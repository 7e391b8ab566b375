// @ts-check
/** The side panel's overview: how well the picture stands, counts, rods by verdict (which is the legend too). */

import { Symbols } from '../map/symbols.js';
import { decidingWords, isEarly, manyUncertain } from '../state/deciding.js';
import * as format from '../state/format.js';
import { VERDICTS, tally } from '../state/rods.js';
import { h, setText } from './dom.js';
import { opacitySlider } from './opacity.js';
import { rodPalette } from './theme.js';

/** @typedef {import('../state/inspection.js').Inspection} Inspection */

const FIGURES = [
  { name: 'snapshots', word: 'Snapshots' },
  { name: 'placed', word: 'Placed' },
  { name: 'uncertain', word: 'Uncertain' },
  { name: 'rejected', word: 'Rejected' },
];

export class Summary {
  #deciding = h('p', { class: 'sentence', id: 'deciding', role: 'status', hidden: true });
  #sentence = h('p', { class: 'sentence', id: 'quality' });
  /** @type {Map<string, HTMLElement>} */ #figures = new Map();
  /** @type {Map<string, {count: HTMLElement, share: HTMLElement, row: HTMLElement, symbol: HTMLElement}>} */ #rods = new Map();
  #coverage = h('dd', { id: 'coverage' });
  #rodsTotal = h('h2');

  /** @param {import('../state/options.js').Options} options */
  constructor(options) {
    const figures = FIGURES.map(({ name, word }) => figure(word, this.#figure(name), name));
    const coverage = h('div', { class: 'figure' }, h('dt', { text: 'Floor seen' }), this.#coverage);
    const seen = figure('Rods seen', this.#figure('seen'), 'seen');
    const head = h('div', { class: 'panel-head' }, this.#rodsTotal, opacitySlider(options, 'rods', 'the rod symbols'));
    this.element = h('div', { class: 'side-part' },
      h('section', {}, head, h('ul', { class: 'legend', id: 'legend' }, ...VERDICTS.map((verdict) => this.#legendRow(verdict)))),
      h('section', {}, h('h2', { text: 'Picture' }), this.#deciding, this.#sentence, h('dl', { class: 'figures' }, ...figures, coverage, seen)));
    this.redraw();
    document.addEventListener('themechange', () => this.redraw());
  }

  /** Draw the legend's symbols in the theme's colours. */
  redraw() {
    const symbols = new Symbols(rodPalette());
    for (const [verdict, { symbol }] of this.#rods) symbol.replaceChildren(symbols.of(SAMPLES[verdict], 11));
  }

  /** @param {Inspection} inspection */
  update(inspection) {
    const { counts = {}, coverage, quality, pond } = inspection.facts;
    const nowMs = inspection.serverMs(Date.now());
    const rods = pond?.rods ?? [];
    const tallied = tally(rods.map((rod) => rod.id), (id) => inspection.rod(id));
    const seen = rods.length - tallied.unseen;
    const judged = format.sentence(quality?.sentence || (counts.snapshots ? 'No judgement of the correction yet.' : 'No snapshot has come yet.'));
    setText(this.#sentence, inspection.heldAtMs === null ? judged : `As known now: ${judged}`);
    for (const { name } of FIGURES) this.#write(name, format.count(counts[name]), share(name, counts));
    this.#write('seen', rods.length ? format.count(seen) : format.NONE, rods.length ? ` of ${format.count(rods.length)}` : '');
    this.#figures.get('uncertain')?.parentElement?.classList.toggle('attention', manyUncertain(inspection) && !isEarly(inspection, nowMs));
    this.#tellDeciding(decidingWords(inspection, nowMs));
    setText(this.#coverage, format.percent(coverage));
    setText(this.#rodsTotal, rods.length ? `Rods · ${format.count(rods.length)}` : 'Rods · no layout, none are read');
    for (const [verdict, row] of this.#rods) {
      const n = tallied[/** @type {import('../state/rods.js').Verdict} */ (verdict)];
      setText(row.count, format.count(n));
      setText(row.share, rods.length ? format.percent(n / rods.length) : '');
      row.row.classList.toggle('attention', verdict === 'conflicting' && n > 0);
    }
  }

  /** @param {string | null} words */
  #tellDeciding(words) {
    this.#deciding.hidden = words === null;
    this.#sentence.hidden = words !== null; // what it judges is not decided
    setText(this.#deciding, words ?? '');
  }

  /** @param {string} name */
  #figure(name) {
    const element = h('dd', { id: `count-${name}` }, h('span'), h('small'));
    this.#figures.set(name, element);
    return element;
  }

  /** @param {string} name @param {string} text @param {string} small */
  #write(name, text, small) {
    const [number, note] = this.#figures.get(name)?.children ?? [];
    if (!number) return;
    setText(number, text);
    setText(note, small);
  }

  /** @param {{verdict: string, word: string}} verdict */
  #legendRow({ verdict, word }) {
    const [symbol, count, shareOf] = [h('span'), h('b', { id: `rods-${verdict}` }), h('span', { class: 'share' })];
    const row = h('li', {}, symbol, h('span', { text: word }), count, shareOf);
    this.#rods.set(verdict, { count, share: shareOf, row, symbol });
    return row;
  }
}

/** @type {Record<string, RodRow>} */
const SAMPLES = {
  full: { rod_id: '', state: 'full', fill: 1, confidence: 1, views: 1 },
  partial: { rod_id: '', state: 'partial', fill: 0.4, confidence: 1, views: 1 },
  empty: { rod_id: '', state: 'empty', fill: 0, confidence: 1, views: 1 },
  conflicting: { rod_id: '', state: 'full', fill: 1, confidence: 0.5, views: 2, conflicting: true },
  unseen: { rod_id: '', state: 'unseen', fill: null, confidence: 0, views: 0 },
};

/** @param {string} word @param {HTMLElement} value @param {string} name */
function figure(word, value, name) {
  return h('div', { class: 'figure', 'data-figure': name }, h('dt', { text: word }), value);
}

/** @param {string} name @param {Partial<Counts>} counts */
function share(name, counts) {
  if (name === 'snapshots' || !counts.snapshots) return '';
  return ` ${format.percent((counts[name] ?? 0) / counts.snapshots)}`;
}
