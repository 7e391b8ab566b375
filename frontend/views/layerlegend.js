// @ts-check
/** The layer's classes, under the map; and over it that the picture is the raw one, or one of the past, unmistakably. */

import { CLASSES } from '../state/classes.js';
import { h, setText } from './dom.js';
import { opacitySlider } from './opacity.js';

export class LayerLegend {
  #note = h('p', { class: 'raw-note', id: 'raw-note' });
  #review = h('p', { class: 'review-note', id: 'review-note' });
  /** Over the map. */ notes = h('div', { class: 'map-notes' }, this.#review, this.#note);
  /** Under it. */ element = h('div', { class: 'layer-legend' });
  #options;
  #opacity;

  /** @param {import('../state/options.js').Options} options */
  constructor(options) {
    this.#options = options;
    this.#opacity = opacitySlider(options, 'layer', 'the layer');
  }

  /** @param {import('../map/snapshotmosaic.js').SnapshotMosaic | null} raw
   * @param {import('../map/snapshotmosaic.js').SnapshotMosaic | null} [past] absent while live
   * @param {boolean} [readThen] whether rods are shown as they read then */
  update(raw, past, readThen = false) {
    const { layer, picture } = this.#options;
    this.#note.hidden = picture !== 'raw';
    if (picture === 'raw') setText(this.#note, `RAW POSES · as the robots said, not corrected${progress(raw)}`);
    this.#review.hidden = past === undefined;
    if (past !== undefined) setText(this.#review, `REVIEW · what was seen by then, ${readThen ? 'rods as they read then' : 'as it is known now'}${picture === 'raw' ? '' : progress(past)}`);
    if (this.element.dataset.layer === layer) return;
    this.element.dataset.layer = layer;
    this.element.replaceChildren();
    if (layer === 'none') return;
    const { title, classes } = CLASSES[layer];
    this.element.append(h('strong', { text: title }), h('ul', {}, ...classes.map(({ word, colour }) => h('li', {}, h('span', { class: `swatch ${colour}` }), word)),
      h('li', {}, h('span', { class: 'swatch never' }), 'never seen')), this.#opacity);
  }
}

/** How far it is drawn, where that is not all. @param {import('../map/snapshotmosaic.js').SnapshotMosaic | null} mosaic */
function progress(mosaic) {
  if (!mosaic) return '';
  const failed = mosaic.failed ? `, ${mosaic.failed} could not be loaded` : '';
  return `${mosaic.drawn < mosaic.wanted ? ` · ${mosaic.drawn} of ${mosaic.wanted} snapshots` : ''}${failed}`;
}
