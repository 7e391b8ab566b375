// @ts-check
/** The layer's classes, on the map; and that the picture is the raw one, unmistakably. */

import { CLASSES } from '../state/classes.js';
import { h } from './dom.js';

export class LayerLegend {
  #note = h('p', { class: 'raw-note', id: 'raw-note' });
  #classes = h('div');
  element = h('div', { class: 'layer-legend' }, this.#note, this.#classes);

  /** @param {import('../state/options.js').Options} options @param {import('../map/rawmosaic.js').RawMosaic | null} raw */
  update({ layer, picture }, raw) {
    this.#note.hidden = picture !== 'raw';
    if (picture === 'raw') this.#note.textContent = rawNote(raw);
    if (this.#classes.dataset.layer === layer) return;
    this.#classes.dataset.layer = layer;
    this.#classes.replaceChildren();
    if (layer === 'none') return;
    const { title, classes } = CLASSES[layer];
    this.#classes.append(h('strong', { text: title }), h('ul', {}, ...classes.map(({ word, colour }) => h('li', {}, h('span', { class: `swatch ${colour}` }), word)),
      h('li', {}, h('span', { class: 'swatch never' }), 'never seen')));
  }
}

/** @param {import('../map/rawmosaic.js').RawMosaic | null} raw */
function rawNote(raw) {
  if (!raw) return 'RAW POSES · as the robots said, not corrected';
  const failed = raw.failed ? `, ${raw.failed} could not be loaded` : '';
  const progress = raw.drawn + raw.failed < raw.wanted ? ` · ${raw.drawn} of ${raw.wanted} snapshots` : '';
  return `RAW POSES · as the robots said, not corrected${progress}${failed}`;
}
