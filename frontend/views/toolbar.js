// @ts-check
/** The row over the map: what it shows. Every button has a key. */

import { CLASSES } from '../state/classes.js';
import { MARKS } from '../state/options.js';
import { h, setAttribute, setText } from './dom.js';

/** @typedef {import('../state/options.js').Options} Options */

const MARK_WORDS = { rods: 'Rods (R)', robots: 'Robots (B)', tracks: 'Tracks (K)', grid: 'Grid (G)' };

export class Toolbar {
  #options;
  #picture = h('button', { type: 'button', id: 'picture', title: 'Raw or corrected poses (C)', onClick: () => this.#options.togglePicture() });
  #layer = h('select', { id: 'layer', 'aria-label': 'Layer', title: 'Layer over the picture (L)', onChange: () => this.#choose() },
    h('option', { value: 'none', text: 'No layer' }), ...layerChoices());
  /** @type {Map<string, HTMLElement>} */ #marks = new Map();

  /** @param {Options} options @param {{find: (text: string) => boolean, rods: string[], measure: () => void, table: () => void, help: () => void}} actions */
  constructor(options, { find, rods, measure, table, help }) {
    this.#options = options;
    for (const mark of MARKS) {
      const [word] = MARK_WORDS[mark].split(' ');
      this.#marks.set(mark, h('button', { type: 'button', id: `layer-${mark}`, title: MARK_WORDS[mark], text: word, onClick: () => options.toggle(mark) }));
    }
    this.element = h('div', { class: 'toolbar', role: 'toolbar', 'aria-label': 'Map' }, this.#picture, this.#layer,
      h('span', { class: 'group' }, ...this.#marks.values()),
      h('button', { type: 'button', id: 'measure', 'aria-pressed': 'false', title: 'Measure a distance (M)', text: 'Measure', onClick: measure }), h('span', { class: 'spacer' }), finder(find, rods),
      h('button', { type: 'button', id: 'table-button', title: 'Everything as tables (D)', text: 'Tables', onClick: table }),
      h('button', { type: 'button', id: 'help-button', title: 'Keys (?)', 'aria-label': 'Keys', text: '?', onClick: help }));
    options.addEventListener('change', () => this.#update());
    this.#update();
  }

  #choose() {
    this.#options.set({ layer: /** @type {import('../state/options.js').Layer} */ (this.#layer.value) });
  }

  #update() {
    const raw = this.#options.picture === 'raw';
    setText(this.#picture, raw ? 'Raw poses' : 'Corrected');
    setAttribute(this.#picture, 'aria-pressed', String(raw));
    this.#layer.value = this.#options.layer;
    for (const mark of MARKS) setAttribute(/** @type {Element} */ (this.#marks.get(mark)), 'aria-pressed', String(this.#options.marks[mark]));
  }
}

function layerChoices() {
  return Object.entries(CLASSES).map(([value, { title }]) => h('option', { value, text: title }));
}

/** @param {(text: string) => boolean} find @param {string[]} rods */
function finder(find, rods) {
  const list = h('datalist', { id: 'rod-ids' }, ...rods.map((id) => h('option', { value: id })));
  const input = h('input', { id: 'find', type: 'search', list: 'rod-ids', placeholder: 'Rod…', size: '7', 'aria-label': 'Find a rod by its name', title: 'Find a rod (/)' });
  const form = h('form', { class: 'finder', hidden: rods.length === 0 }, input, list);
  form.addEventListener('submit', (event) => {
    event.preventDefault();
    const found = find(input.value.trim());
    input.setCustomValidity(found ? '' : 'There is no such rod.');
    if (found) input.blur();
    else input.reportValidity();
  });
  input.addEventListener('input', () => input.setCustomValidity(''));
  return form;
}
