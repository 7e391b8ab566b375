// @ts-check
/** The map of one inspection: what is painted, from what state. */

import { paintChosen, paintFloor, paintMosaic, paintOutline, paintRobots, paintRods } from '../map/painters.js';
import { PondMap } from '../map/pondmap.js';
import { RasterCanvas } from '../map/raster.js';
import { Symbols } from '../map/symbols.js';
import { Painted } from '../state/painted.js';
import { rodAt } from '../state/rods.js';
import { robotViews } from '../state/robots.js';
import { mapColours, rodPalette } from './theme.js';

/** @typedef {import('../map/frame.js').Frame} Frame */

const REACH_PX = 10;

export class PondView extends EventTarget {
  #inspection;
  #pond;
  #map;
  #colours = mapColours();
  #symbols = new Symbols(rodPalette());
  painted = new Painted();
  /** @type {RodLayout | null} */ chosenRod = null;
  /** @type {Evidence | null} */ evidence = null;
  shows = { rods: true, robots: true };

  /**
   * @param {HTMLElement} target @param {import('../state/inspection.js').Inspection} inspection
   * @param {Raster} raster @param {Pond} pond
   */
  constructor(target, inspection, raster, pond) {
    super();
    this.#inspection = inspection;
    this.#pond = pond;
    this.mosaic = new RasterCanvas(raster);
    this.#map = new PondMap(target, pond, raster.metres_per_pixel, (context, frame) => this.#paint(context, frame));
    this.#map.addEventListener('choose', (event) => this.#choose(/** @type {CustomEvent} */ (event).detail));
    this.#map.addEventListener('pointer', (event) => this.#forward(/** @type {CustomEvent} */ (event)));
    document.addEventListener('themechange', () => this.#retheme());
  }

  get map() { return this.#map; }
  repaint() { this.#map.repaint(); }

  /** @param {CanvasRenderingContext2D} context @param {Frame} frame */
  #paint(context, frame) {
    const { camera } = this.#inspection.facts;
    const rods = this.#pond.rods ?? [];
    paintFloor(context, frame, this.#pond, this.#colours);
    paintMosaic(context, frame, this.mosaic, this.#pond);
    if (this.shows.rods) paintRods(context, frame, rods, (id) => this.#inspection.rod(id), this.#symbols);
    if (this.shows.robots) paintRobots(context, frame, robotViews(this.#inspection, Date.now()), camera, this.#colours);
    if (this.chosenRod) paintChosen(context, frame, this.chosenRod, this.#colours);
    if (this.evidence && camera) this.#paintEvidence(context, frame, this.evidence, camera);
    this.painted.drawn(performance.timeOrigin + performance.now());
  }

  /** Raw (dashed) and corrected (solid). @param {CanvasRenderingContext2D} context @param {Frame} frame @param {Evidence} evidence @param {Camera} camera */
  #paintEvidence(context, frame, { raw, corrected }, camera) {
    const { choice, paper } = this.#colours;
    paintOutline(context, frame, raw, camera, choice, { dash: [7, 5], paper });
    if (corrected) paintOutline(context, frame, corrected, camera, choice, { width: 3, paper });
  }

  /** @param {{xM: number, yM: number}} at */
  #choose({ xM, yM }) {
    const rod = rodAt(this.#pond.rods ?? [], xM, yM, REACH_PX * this.#map.metresPerPx);
    this.dispatchEvent(new CustomEvent('choose', { detail: rod }));
  }

  /** @param {CustomEvent} event */
  #forward(event) {
    this.dispatchEvent(new CustomEvent(event.type, { detail: event.detail }));
  }

  #retheme() {
    this.#colours = mapColours();
    this.#symbols = new Symbols(rodPalette());
    this.repaint();
  }
}
