// @ts-check
/** The layer's classes, on the map; and that the picture is the raw one, unmistakably. */

import { CLASSES } from '../state/classes.js';
import { h, setText } from './dom.js';

export class LayerLegend {
  #note = h('p', { class: 'raw-note', id: 'raw-note' });
  #review = h('p', { class: 'review-note', id: 'review-note' });
  #classes = h('div');
  element = h('div', { class: 'layer-legend' }, this.#review, this.#note, this.#classes);

  /** @param {import('../state/options.js').Options} options @param {import('../map/snapshotmosaic.js').SnapshotMosaic | null} raw
   * @param {import('../map/snapshotmosaic.js').SnapshotMosaic | null} [past] absent while live */
  update({ layer, picture }, raw, past) {
    this.#note.hidden = picture !== 'raw';
    if (picture === 'raw') setText(this.#note, `RAW POSES · as the robots said, not corrected${progress(raw)}`);
    this.#review.hidden = past === undefined;
    if (past !== undefined) setText(this.#review, `REVIEW · what was seen by then, as it is known now${picture === 'raw' ? '' : progress(past)}`);
    if (this.#classes.dataset.layer === layer) return;
    this.#classes.dataset.layer = layer;
    this.#classes.replaceChildren();
    if (layer === 'none') return;
    const { title, classes } = CLASSES[layer];
    this.#classes.append(h('strong', { text: title }), h('ul', {}, ...classes.map(({ word, colour }) => h('li', {}, h('span', { class: `swatch ${colour}` }), word)),
      h('li', {}, h('span', { class: 'swatch never' }), 'never seen')));
  }
}

/** How far it is drawn, where that is not all. @param {import('../map/snapshotmosaic.js').SnapshotMosaic | null} mosaic */
function progress(mosaic) {
  if (!mosaic) return '';
  const failed = mosaic.failed ? `, ${mosaic.failed} could not be loaded` : '';
  return `${mosaic.drawn < mosaic.wanted ? ` · ${mosaic.drawn} of ${mosaic.wanted} snapshots` : ''}${failed}`;
}
