// @ts-check
/**
 * The map: pond metres, x right and y up. The library keeps the view (pan, zoom, keys, scale bar); everything shown
 * is painted into one canvas by the painters handed in.
 */

import { Frame } from './frame.js';
import { library } from './ol.js';

/** @typedef {(context: CanvasRenderingContext2D, frame: Frame) => void} Painter */

export class PondMap extends EventTarget {
  #canvas = document.createElement('canvas');
  #map;
  #layer;
  /** @type {Painter} */ #paint;
  /** Metres: left, bottom, right, top. */ #extent;
  /** Whether the whole pond is shown, and so is kept in sight when the window changes; shared by maps of one view. */ #kept = { whole: true };

  /**
   * @param {HTMLElement} target @param {Pond} pond @param {number} metresPerPixel of the raster @param {Painter} paint
   * @param {PondMap} [twin] a map whose view this one shares
   */
  constructor(target, pond, metresPerPixel, paint, twin) {
    super();
    this.#paint = paint;
    this.#extent = [0, 0, pond.width_m, pond.height_m];
    this.#canvas.className = 'pond-canvas';
    const options = { render: (/** @type {any} */ state) => this.#render(state) };
    this.#layer = new library.layer.Layer(/** @type {any} */ (options));
    this.#map = new library.Map({
      target,
      layers: [this.#layer],
      view: twin ? twin.#map.getView() : this.#makeView(pond, metresPerPixel),
      controls: [new library.control.ScaleLine({ minWidth: 90 })],
      interactions: library.interaction.defaults.defaults({ altShiftDragRotate: false, pinchRotate: false }), // without focus too
      keyboardEventTarget: target,
    });
    this.#map.on('pointermove', (event) => this.#tell('pointer', event.coordinate));
    this.#map.on('singleclick', (event) => this.#tell('choose', event.coordinate));
    if (twin) this.#kept = twin.#kept;
    this.#map.on('moveend', () => this.dispatchEvent(new Event('moved')));
    this.#map.on('change:size', () => { if (this.#whole) this.fit(); });
    this.#map.on('pointerdrag', () => { this.#whole = false; });
    target.addEventListener('wheel', () => { this.#whole = false; }, { passive: true });
    target.addEventListener('keydown', (event) => { if (event.key.startsWith('Arrow')) this.#whole = false; });
    if (!twin) this.fit();
  }

  get #whole() { return this.#kept.whole; }
  set #whole(whole) { this.#kept.whole = whole; }

  /** The pond's place in the middle of the map. */
  get centre() {
    const [xM, yM] = this.#map.getView().getCenter() ?? [0, 0];
    return { xM, yM };
  }

  /** Where it looks; null while it keeps the whole pond in sight. @type {import('../state/address.js').MapView | null} */
  get view() { return this.#whole ? null : { ...this.centre, metresPerPx: this.metresPerPx }; }

  /** Metres a screen pixel. */
  get metresPerPx() { return this.#map.getView().getResolution() ?? 1; }

  repaint() { this.#layer.changed(); }

  /** The whole pond, clear of the buttons and the scale bar. */
  fit() {
    this.#map.getView().fit(this.#extent, { size: this.#map.getSize(), padding: [16, 24, 54, 48] });
    this.#whole = true;
  }

  /** @param {number} factor above 1: closer */
  zoom(factor) {
    this.#whole = false;
    const view = this.#map.getView();
    view.animate({ resolution: view.getConstrainedResolution(this.metresPerPx / factor) ?? this.metresPerPx, duration: 120 });
  }

  /** @param {number} xM @param {number} yM @param {number} [metresPerPx] */
  goTo(xM, yM, metresPerPx) {
    this.#whole = false;
    this.#map.getView().animate({ center: [xM, yM], resolution: metresPerPx ?? this.metresPerPx, duration: 200 });
  }

  /** Bring a place into sight, where it is not. @param {number} xM @param {number} yM */
  reveal(xM, yM) {
    const [left, bottom, right, top] = this.#map.getView().calculateExtent(this.#map.getSize());
    if (xM < left || xM > right || yM < bottom || yM > top) this.goTo(xM, yM);
  }

  /** Look there at once. @param {import('../state/address.js').MapView} view */
  show({ xM, yM, metresPerPx }) {
    this.#whole = false;
    const view = this.#map.getView();
    view.setCenter([xM, yM]);
    view.setResolution(metresPerPx);
  }

  dispose() { this.#map.setTarget(undefined); }

  /** @param {Pond} pond @param {number} metresPerPixel */
  #makeView(pond, metresPerPixel) {
    const projection = new library.proj.Projection({ code: 'pond', units: 'm', extent: this.#extent, metersPerUnit: 1 });
    return new library.View({
      projection,
      center: [pond.width_m / 2, pond.height_m / 2],
      extent: this.#extent,
      constrainOnlyCenter: true,
      enableRotation: false,
      minResolution: metresPerPixel / 24,
      maxResolution: Math.max(pond.width_m, pond.height_m) / 200,
    });
  }

  /** @param {any} state the library's frame state */
  #render(state) {
    const [widthPx, heightPx] = state.size;
    const { center, resolution } = state.viewState;
    const frame = new Frame({ widthPx, heightPx, centreM: center, metresPerPx: resolution, pixelRatio: state.pixelRatio });
    if (this.#canvas.width !== frame.width || this.#canvas.height !== frame.height) {
      [this.#canvas.width, this.#canvas.height] = [frame.width, frame.height];
    }
    const context = /** @type {CanvasRenderingContext2D} */ (this.#canvas.getContext('2d'));
    context.clearRect(0, 0, frame.width, frame.height);
    context.save(); // no painter sees what another left
    this.#paint(context, frame);
    context.restore();
    return this.#canvas;
  }

  /** @param {string} type @param {number[]} coordinate */
  #tell(type, [xM, yM]) {
    this.dispatchEvent(new CustomEvent(type, { detail: { xM, yM } }));
  }
}
