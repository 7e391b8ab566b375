// @ts-check
/** A value over the last minutes, as a line beside the number: where it goes says more than where it is. */

import { h } from './dom.js';

const SVG = 'http://www.w3.org/2000/svg';
const [WIDTH, HEIGHT] = [64, 18];

export class Trend {
  #line = document.createElementNS(SVG, 'path');
  element = h('span', { class: 'trend', role: 'img' });

  /** @param {string} word what it is of */
  constructor(word) {
    const picture = document.createElementNS(SVG, 'svg');
    picture.setAttribute('viewBox', `0 0 ${WIDTH} ${HEIGHT}`);
    picture.setAttribute('aria-hidden', 'true');
    picture.append(this.#line);
    this.element.append(picture);
    this.element.setAttribute('aria-label', `${word}, the last five minutes`);
  }

  /** @param {(number | null)[]} values oldest first; null: a gap @param {number} most how many there may be */
  show(values, most) {
    const path = pathOf(values, most);
    if (this.#line.getAttribute('d') !== path) this.#line.setAttribute('d', path);
  }
}

/** Zero at the bottom, the greatest at the top, the newest at the right. @param {(number | null)[]} values @param {number} most */
export function pathOf(values, most) {
  const top = Math.max(...values.map((value) => value ?? 0), Number.MIN_VALUE);
  let pen = 'M';
  return values.map((value, i) => {
    if (value === null) {
      pen = 'M';
      return '';
    }
    const x = WIDTH - ((values.length - 1 - i) / Math.max(1, most - 1)) * WIDTH;
    const point = `${pen}${x.toFixed(1)} ${(HEIGHT - 1 - (value / top) * (HEIGHT - 2)).toFixed(1)}`;
    pen = 'L';
    return point;
  }).join('');
}
