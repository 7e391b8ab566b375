// @ts-check
/** The row over the compared maps: how the two are shown. Every button has a key. */

import { h, setAttribute, setText } from './dom.js';

/** @typedef {import('../state/comparison.js').CompareOptions} CompareOptions */
/** @typedef {import('../state/comparison.js').Mode} Mode */
/** @typedef {import('../state/comparison.js').Shown} Shown */

/** @type {[Mode, string][]} */
export const MODE_WORDS = [['side', 'Side by side'], ['swipe', 'Swipe'], ['blink', 'Blink'], ['opacity', 'Opacity'], ['difference', 'Difference']];
/** @type {[Shown, string, string][]} */
const SHOWN_WORDS = [['changes', 'Marks', 'Marks on the rods that are listed (M)'], ['rods', 'Rods', 'What each rod reads as (R)'], ['grid', 'Grid', 'Grid of metres (G)']];

export class CompareToolbar {
  #options;
  /** @type {Map<string, HTMLElement>} */ #buttons = new Map();
  #flip = h('button', { type: 'button', id: 'flip', title: 'Before or after, the one key (X)', text: 'Flip', onClick: () => this.#options.flip() });
  #auto = h('button', { type: 'button', id: 'auto', title: 'Blink by itself; press again to stop (B)', text: 'By itself' });
  #slider = h('input', { type: 'range', id: 'at', min: '0', max: '1', step: '0.01', onInput: () => this.#options.set({ at: Number(this.#slider.value) }) });
  #refused = false;

  /** @param {CompareOptions} options @param {{auto: () => void, table: () => void, help: () => void}} actions */
  constructor(options, { auto, table, help }) {
    this.#options = options;
    this.#auto.addEventListener('click', auto);
    const modes = MODE_WORDS.map(([mode, word], i) => this.#button(mode, word, `${word} (${i + 1})`, () => options.set({ mode })));
    const marks = SHOWN_WORDS.map(([name, word, title]) => this.#button(name, word, title, () => options.toggle(name)));
    this.element = h('div', { class: 'toolbar', role: 'toolbar', 'aria-label': 'How the two are shown' },
      h('span', { class: 'group' }, ...modes), this.#flip, this.#auto, this.#slider, h('span', { class: 'spacer' }), h('span', { class: 'group' }, ...marks),
      h('button', { type: 'button', id: 'table-button', title: 'Everything as a table (D)', text: 'Table', onClick: table }),
      h('button', { type: 'button', id: 'help-button', title: 'Keys (?)', 'aria-label': 'Keys', text: '?', onClick: help }));
    options.addEventListener('change', () => this.update());
    this.update();
  }

  /** Where no difference is claimed, none is painted either. */
  refuse() {
    this.#refused = true;
    this.update();
  }

  /** @param {boolean} blinks */
  blinking(blinks) { setAttribute(this.#auto, 'aria-pressed', String(blinks)); }

  update() {
    const { mode, shown, at, front } = this.#options;
    for (const [name] of MODE_WORDS) this.#press(name, mode === name);
    for (const [name] of SHOWN_WORDS) this.#press(name, shown[name]);
    const difference = /** @type {HTMLButtonElement} */ (this.#buttons.get('difference'));
    difference.disabled = this.#refused;
    if (this.#refused) difference.title = 'No difference is claimed of these two';
    this.#auto.hidden = mode !== 'blink';
    this.#slider.hidden = mode !== 'swipe' && mode !== 'opacity';
    setAttribute(this.#slider, 'aria-label', mode === 'swipe' ? 'Where the divider stands' : 'How much of the later shows through');
    this.#slider.value = String(at);
    setText(this.#flip, mode === 'blink' ? front === 'base' ? 'Show after' : 'Show before' : 'Flip');
  }

  /** @param {string} name @param {boolean} pressed */
  #press(name, pressed) { setAttribute(/** @type {HTMLElement} */ (this.#buttons.get(name)), 'aria-pressed', String(pressed)); }

  /** @param {string} name @param {string} text @param {string} title @param {() => void} onClick */
  #button(name, text, title, onClick) {
    const button = h('button', { type: 'button', id: `show-${name}`, title, text, onClick });
    this.#buttons.set(name, button);
    return button;
  }
}
