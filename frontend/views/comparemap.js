// @ts-check
/** The maps of two inspections: two that share a view, or one in which the two lie over each other. */

import { Sheet, paintChanges, paintDifference, paintOne, paintSwiped } from '../map/comparepainters.js';
import { paintChosen, paintRods } from '../map/painters.js';
import { PondMap } from '../map/pondmap.js';
import { Symbols } from '../map/symbols.js';
import { TileMosaic } from '../map/tilemosaic.js';
import { paintGrid, paintGridNames } from '../map/tracks.js';
import * as format from '../state/format.js';
import { rodAt } from '../state/rods.js';
import { h, setText } from './dom.js';
import { mapColours, rodPalette } from './theme.js';

/** @typedef {import('../state/comparison.js').CompareOptions} CompareOptions */
/** @typedef {import('../state/comparison.js').SideName} SideName */
/** @typedef {import('../map/frame.js').Frame} Frame */
/** One inspection on the map. rows: its readings by rod, once they were asked for.
 * @typedef {{facts: SessionFacts, mosaic: TileMosaic, rows: Map<string, RodRow> | null}} MapSide */

const REACH_PX = 10;
/** @type {RodRow} */ const UNREAD = { rod_id: '', state: 'unseen', fill: null, confidence: 0, views: 0 };

export class CompareMap extends EventTarget {
  #options;
  #first = box('map-first', 'Map of the pond');
  #second = box('map-second', 'Map of the pond, after');
  #handle = h('div', { class: 'swipe-handle', 'aria-hidden': 'true' }, h('span', { text: '⇔' }));
  #labels = { base: h('div', { class: 'map-label', text: 'Before' }), with: h('div', { class: 'map-label after', text: 'After' }) };
  #left = h('div', { class: 'map-half' }, this.#first, this.#labels.base, this.#handle);
  #right = h('div', { class: 'map-half', hidden: true }, this.#second, this.#labels.with);
  element = h('div', { class: 'map-area compare-maps' }, this.#left, this.#right);
  /** @type {Record<SideName, MapSide> | null} */ #sides = null;
  /** @type {PondMap[]} */ #maps = [];
  /** Maps that were painted, by what they show. @type {Set<SideName>} */ #painted = new Set();
  #colours = mapColours();
  #symbols = new Symbols(rodPalette());
  #sheets = /** @type {[Sheet, Sheet, Sheet]} */ ([new Sheet(), new Sheet(), new Sheet()]);
  /** @type {Map<string, RodLayout>} */ #layout = new Map();
  /** Rods that bear a mark. @type {RodChange[]} */ marked = [];

  /** @param {CompareOptions} options */
  constructor(options) {
    super();
    this.#options = options;
    this.#dragged();
    document.addEventListener('themechange', () => { this.#colours = mapColours(); this.#symbols = new Symbols(rodPalette()); this.repaint(); });
  }

  /** Tiles on their way. */
  get waiting() { return this.#sides ? this.#sides.base.mosaic.waiting + this.#sides.with.mosaic.waiting : 0; }
  /** Whether each map that is shown was painted with all its tiles. */
  get whole() { return this.#maps.length > 0 && this.#painted.size >= this.#maps.length && this.waiting === 0; }
  get view() { return this.#maps[0] ?? null; }
  get sides() { return this.#sides; }

  /** @param {SessionFacts} base @param {SessionFacts} later */
  open(base, later) {
    this.#sides = { base: this.#side(base), with: this.#side(later) };
    const pond = /** @type {Pond} */ (base.pond);
    this.#layout = new Map([...(later.pond?.rods ?? []), ...(pond.rods ?? [])].map((rod) => [rod.id, rod]));
    const scale = Math.min(...[base, later].map(({ raster }) => raster?.metres_per_pixel ?? Infinity));
    this.#right.hidden = this.#options.mode !== 'side'; // before a map measures its room: tiles are asked for at its first painting
    const map = this.#makeMap(this.#first, pond, scale);
    if (this.#options.place) map.show(this.#options.place);
    map.addEventListener('moved', () => this.#options.set({ place: map.view }));
    this.update();
  }

  /** @param {SessionFacts} facts @returns {MapSide} */
  #side(facts) {
    const mosaic = new TileMosaic(facts.id, facts.revision, /** @type {Raster} */ (facts.raster));
    mosaic.addEventListener('waiting', () => this.#label());
    mosaic.addEventListener('drawn', () => { this.#label(); this.repaint(); });
    return { facts, mosaic, rows: null };
  }

  /** @param {HTMLElement} target @param {Pond} pond @param {number} scale */
  #makeMap(target, pond, scale) {
    const is = this.#maps.length ? 'with' : 'base';
    const map = new PondMap(target, pond, scale, (context, frame) => this.#paint(context, frame, is), this.#maps[0]);
    map.addEventListener('choose', (event) => this.#choose(/** @type {CustomEvent} */ (event).detail));
    this.#maps.push(map);
    return map;
  }

  /** The maps as the options want them. */
  update() {
    const { mode, at } = this.#options;
    const two = mode === 'side';
    this.#right.hidden = !two;
    if (this.#sides && two && this.#maps.length < 2) {
      this.#makeMap(this.#second, /** @type {Pond} */ (this.#sides.base.facts.pond), /** @type {Raster} */ (this.#sides.base.facts.raster).metres_per_pixel);
    } else if (!two) this.#maps.splice(1).forEach((map) => map.dispose());
    this.#handle.hidden = mode !== 'swipe';
    this.#handle.style.left = `${at * 100}%`;
    this.#label();
    this.repaint();
  }

  /** What each map shows, and whether more of it is on its way: what lacks looks as if it was never seen. */
  #label() {
    const { mode, front, at } = this.#options;
    const shown = { side: 'Before', swipe: 'Before  ⇔  After', blink: front === 'base' ? 'Before' : 'After', opacity: `Before, and ${format.percent(at)} of after over it`,
      difference: 'Difference of the pictures: dark where they differ' }[mode];
    const more = (/** @type {SideName[]} */ ...of) => (of.some((side) => this.#sides?.[side].mosaic.waiting) ? '  loading…' : '');
    setText(this.#labels.base, shown + (mode === 'side' ? more('base') : more('base', 'with')));
    setText(this.#labels.with, `After${more('with')}`);
    this.#labels.base.classList.toggle('after', mode === 'blink' && front === 'with');
  }

  repaint() { this.#maps.forEach((map) => map.repaint()); }

  /** @param {string} id @param {boolean} closely */
  goTo(id, closely) {
    const rod = this.#layout.get(id);
    if (rod) this.view?.goTo(rod.x_m, rod.y_m, closely ? Math.min(this.view.metresPerPx, rod.outer_radius_m / 45) : undefined);
  }

  /** @param {string} id */
  rod(id) { return this.#layout.get(id); }
  get rods() { return [...this.#layout.values()]; }

  /** @param {CanvasRenderingContext2D} context @param {Frame} frame @param {SideName} is which of the two maps */
  #paint(context, frame, is) {
    if (!this.#sides) return;
    const { shown, rod } = this.#options;
    const ground = this.#ground;
    this.#paintPictures(context, frame, is);
    if (shown.grid) paintGrid(context, frame, ground.pond, this.#colours);
    const chosen = rod && this.#layout.get(rod);
    if (chosen) paintChosen(context, frame, chosen, this.#colours); // below the badges, which say what changed
    if (shown.changes) paintChanges(context, frame, this.marked, (id) => this.#layout.get(id), this.#colours);
    if (shown.grid) paintGridNames(context, frame, ground.pond, this.#colours);
    this.#painted.add(is);
    this.dispatchEvent(new Event('painted'));
  }

  get #ground() { return { pond: /** @type {Pond} */ (this.#sides?.base.facts.pond), colours: this.#colours }; }

  /** @param {CanvasRenderingContext2D} context @param {Frame} frame @param {SideName} is */
  #paintPictures(context, frame, is) {
    const { mode, front, at } = this.#options;
    const { base, with: later } = /** @type {Record<SideName, MapSide>} */ (this.#sides);
    const one = (/** @type {CanvasRenderingContext2D} */ on, /** @type {MapSide} */ side) => this.#paintSide(on, frame, side);
    if (mode === 'difference') return paintDifference(context, frame, [base.mosaic, later.mosaic], this.#ground, this.#sheets);
    if (mode === 'side') return one(context, is === 'base' ? base : later);
    if (mode === 'blink') return one(context, front === 'base' ? base : later);
    one(context, base);
    if (mode === 'swipe') return paintSwiped(context, frame, at, (on) => one(on, later), this.#colours);
    this.#sheets[0].fill(frame, (on) => one(on, later));
    context.globalAlpha = at;
    context.drawImage(this.#sheets[0].canvas, 0, 0);
    context.globalAlpha = 1;
  }

  /** @param {CanvasRenderingContext2D} context @param {Frame} frame @param {MapSide} side */
  #paintSide(context, frame, { facts, mosaic, rows }) {
    paintOne(context, frame, mosaic, this.#ground);
    if (this.#options.shown.rods && rows) paintRods(context, frame, facts.pond?.rods ?? [], (id) => rows.get(id) ?? UNREAD, this.#symbols, 1);
  }

  /** @param {{xM: number, yM: number}} at */
  #choose({ xM, yM }) {
    const rod = rodAt(this.rods, xM, yM, REACH_PX * (this.view?.metresPerPx ?? 0));
    this.dispatchEvent(new CustomEvent('choose', { detail: rod?.id ?? null }));
  }

  /** The divider follows the pointer; its slider in the toolbar is for the keyboard. */
  #dragged() {
    const handle = this.#handle;
    handle.addEventListener('pointerdown', (event) => { handle.setPointerCapture(event.pointerId); event.preventDefault(); });
    handle.addEventListener('pointermove', (event) => {
      if (!handle.hasPointerCapture(event.pointerId)) return;
      const { left, width } = this.#left.getBoundingClientRect();
      this.#options.set({ at: Math.round(Math.min(1, Math.max(0, (event.clientX - left) / width)) * 1000) / 1000 });
    });
  }
}

/** @param {string} id @param {string} label */
function box(id, label) {
  return h('div', { class: 'map', id, tabindex: '0', role: 'application', 'aria-label': `${label}; arrow keys pan, plus and minus zoom` });
}
