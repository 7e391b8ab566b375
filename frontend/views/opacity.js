// @ts-check
/** How much is seen through the rods' symbols, or through the layer. */

import { h } from './dom.js';

/** @param {import('../state/options.js').Options} options @param {import('../state/options.js').Sheet} sheet @param {string} word of what */
export function opacitySlider(options, sheet, word) {
  const input = h('input', { type: 'range', id: `opacity-${sheet}`, min: '0.1', max: '1', step: '0.05', 'aria-label': `Opacity of ${word}`, title: `Opacity of ${word}`,
    onInput: () => options.fade(sheet, Number(input.value)) });
  const follow = () => { input.value = String(options.opacity[sheet]); };
  options.addEventListener('change', follow);
  follow();
  return h('label', { class: 'opacity' }, 'Opacity', input);
}
