// @ts-check
/** The map of one inspection: what is painted, from what state, by what options. */

import { snapshotUrl } from '../api/client.js';
import { Overlay } from '../map/overlay.js';
import { paintChosen, paintFloor, paintMosaic, paintNext, paintNotes, paintOutline, paintRobots, paintRods } from '../map/painters.js';
import { PondMap } from '../map/pondmap.js';
import { RasterCanvas } from '../map/raster.js';
import { SnapshotMosaic, asCorrected, asSaid } from '../map/snapshotmosaic.js';
import { Symbols } from '../map/symbols.js';
import { paintGrid, paintGridNames, paintMeasure, paintTracks } from '../map/tracks.js';
import * as format from '../state/format.js';
import { Looks } from '../state/looks.js';
import { Measure } from '../state/measure.js';
import { Painted } from '../state/painted.js';
import { rodAt } from '../state/rods.js';
import { robotViews } from '../state/robots.js';
import { mapColours, rodPalette } from './theme.js';

/** @typedef {import('../map/frame.js').Frame} Frame */

const REACH_PX = 10;
const FINDING_PX = 40; // the least that a finding measures on the screen when one goes to it
const RECOUNT_MS = 1000;

export class PondView extends EventTarget {
  #inspection;
  #pond;
  #options;
  #map;
  #colours = mapColours();
  #symbols = new Symbols(rodPalette());
  #overlay = new Overlay();
  #countedAt = -Infinity;
  #countedRevision = -1;
  painted = new Painted();
  measure = new Measure();
  /** @type {RodLayout | null} */ chosenRod = null;
  /** @type {Evidence | null} */ evidence = null;
  /** The snapshots where the robots said they were, while that is shown. @type {SnapshotMosaic | null} */ raw = null;
  /** The snapshots as far as a moment of the past, while that is shown. @type {SnapshotMosaic | null} */ past = null;
  /** What is ringed beside a rod. @type {RodPlace | null} */ finding = null;
  /** Whether the server is heard. */ linked = true;
  /** @type {Looks | null} */ looks = null;
  /** Where to look next, while that is pointed at. @type {{xM: number, yM: number} | null} */ pointed = null;

  /**
   * @param {HTMLElement} target @param {import('../state/inspection.js').Inspection} inspection
   * @param {Raster} raster @param {Pond} pond @param {import('../state/options.js').Options} options
   */
  constructor(target, inspection, raster, pond, options) {
    super();
    this.#inspection = inspection;
    this.#pond = pond;
    this.#options = options;
    this.mosaic = new RasterCanvas(raster);
    if (inspection.facts.camera) this.looks = new Looks(pond, inspection.facts.camera);
    this.#map = new PondMap(target, pond, raster.metres_per_pixel, (context, frame) => this.#paint(context, frame));
    this.#map.addEventListener('choose', (event) => this.#choose(/** @type {CustomEvent} */ (event).detail));
    this.#map.addEventListener('moved', () => this.dispatchEvent(new Event('moved')));
    this.#map.addEventListener('pointer', (event) => this.dispatchEvent(new CustomEvent('pointer', { detail: /** @type {CustomEvent} */ (event).detail })));
    options.addEventListener('change', () => this.#optionsChanged());
    document.addEventListener('themechange', () => this.#retheme());
    this.refresh();
  }

  get map() { return this.#map; }
  get pond() { return this.#pond; }
  repaint() { this.#map.repaint(); }

  /** Everything derived, anew: options changed, or some time passed. */
  refresh() {
    this.recount(true);
    this.#fill();
    this.repaint();
  }

  /** How much is seen through changes nothing that is derived. */
  #optionsChanged() {
    const { layer, picture } = this.#options;
    const derived = `${layer} ${picture}`;
    if (derived === this.#derived) this.repaint();
    else this.refresh();
    this.#derived = derived;
  }
  #derived = '';

  /** Count looks again, where there is something new and it was not done just now. @param {boolean} [now] */
  recount(now = false) {
    const revision = this.#inspection.revision ?? -1;
    const at = performance.now();
    const stale = revision !== this.#countedRevision || this.#options.layer === 'age';
    if (!this.looks || (!now && (!stale || at - this.#countedAt < RECOUNT_MS))) return;
    const serverMs = this.#inspection.serverMs(Date.now());
    this.looks.count(this.#inspection.poses.values(), serverMs);
    const { layer } = this.#options;
    if (layer !== 'none') this.#overlay.fill(this.looks, layer, serverMs, this.mosaic.raster.metres_per_pixel, this.#colours);
    this.#countedRevision = revision;
    this.#countedAt = performance.now() + 5 * (performance.now() - at); // never more than a sixth of the time
    if (layer !== 'none') this.repaint();
  }

  /** Show another moment. @param {import('../state/inspection.js').Inspection} shown @param {boolean} live */
  show(shown, live) {
    this.#inspection = shown;
    this.#live = live;
    this.refresh();
  }
  #live = true;

  /** New snapshots came. */
  advance() {
    this.#fill();
    this.recount();
    this.repaint();
  }

  /** Fill the mosaic that is made here, where one is shown. */
  #fill() {
    const { camera, id } = this.#inspection.facts;
    if (!camera) return;
    const make = (/** @type {import('../map/snapshotmosaic.js').Placing} */ placing) => {
      const made = new SnapshotMosaic(this.mosaic.raster, this.#pond, camera, (key) => snapshotUrl(id, key), placing);
      made.addEventListener('drawn', () => this.repaint());
      return made;
    };
    if (this.#options.picture === 'raw') (this.raw ??= make(asSaid)).show(this.#inspection.poses.values());
    else if (!this.#live) (this.past ??= make(asCorrected)).show(this.#inspection.poses.values());
  }

  get #raster() {
    if (this.#options.picture === 'raw' && this.raw) return this.raw.raster;
    return !this.#live && this.past ? this.past.raster : this.mosaic;
  }

  /** @param {CanvasRenderingContext2D} context @param {Frame} frame */
  #paint(context, frame) {
    const { marks, picture, layer, opacity } = this.#options;
    const { camera } = this.#inspection.facts;
    const robots = robotViews(this.#inspection, Date.now(), this.linked);
    paintFloor(context, frame, this.#pond, this.#colours);
    paintMosaic(context, frame, this.#raster, this.#pond);
    if (layer !== 'none') this.#overlay.paint(context, frame, this.#pond, opacity.layer);
    if (marks.grid) paintGrid(context, frame, this.#pond, this.#colours);
    if (marks.rods) paintRods(context, frame, this.#pond.rods ?? [], (id) => this.#inspection.rod(id), this.#symbols, opacity.rods);
    if (marks.grid) paintGridNames(context, frame, this.#pond, this.#colours);
    if (marks.tracks) paintTracks(context, frame, this.#inspection.poses.values(), this.#colours);
    if (marks.robots) paintRobots(context, frame, picture === 'raw' ? robots.map(whereSaid) : robots, camera, this.#colours);
    paintNotes(context, frame, this.#inspection.notes.values(), this.#colours);
    if (this.pointed && camera) paintNext(context, frame, this.pointed, camera, this.#colours);
    if (this.chosenRod) paintChosen(context, frame, this.chosenRod, this.#colours);
    if (this.finding) paintChosen(context, frame, this.finding, this.#colours);
    if (this.evidence && camera) this.#paintEvidence(context, frame, this.evidence, camera);
    if (this.measure.active) paintMeasure(context, frame, this.measure, format.length(this.measure.distanceM), this.#colours);
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
    if (this.measure.active) return this.measureTo({ xM, yM });
    const rod = rodAt(this.#pond.rods ?? [], xM, yM, REACH_PX * this.#map.metresPerPx);
    this.dispatchEvent(new CustomEvent('choose', { detail: rod }));
  }

  /** Ring a finding, and come close enough to see what it is. @param {import('../api/client.js').Finding} finding */
  goToFinding({ x_m, y_m, size_mm }) {
    this.finding = { x_m, y_m, outer_radius_m: 0.8e-3 * size_mm };
    this.#map.goTo(x_m, y_m, Math.min(this.#map.metresPerPx, (1e-3 * size_mm) / FINDING_PX));
    this.repaint();
  }

  toggleMeasure() {
    this.measure.toggle();
    this.#told();
  }

  /** A point of the distance; the middle of the map where none is given. @param {{xM: number, yM: number}} [place] */
  measureTo(place = this.#map.centre) {
    if (!this.measure.active) return;
    this.measure.add(place);
    this.#told();
  }

  #told() {
    this.dispatchEvent(new Event('measure'));
    this.repaint();
  }

  #retheme() {
    this.#colours = mapColours();
    this.#symbols = new Symbols(rodPalette());
    this.refresh();
  }
}

/** A robot where it said that it was. @param {import('../state/robots.js').RobotView} robot */
function whereSaid(robot) {
  const { raw_x_m = null, raw_y_m = null, raw_theta_rad = null } = robot.pose;
  return { ...robot, pose: { ...robot.pose, x_m: raw_x_m, y_m: raw_y_m, theta_rad: raw_theta_rad } };
}
