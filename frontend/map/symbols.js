// @ts-check
/**
 * Rods as small pictures: shape and letter say the verdict, colour only helps. Each is drawn once a size and kept.
 */

import { fillOf, labelOf, verdictOf } from '../state/rods.js';

const LETTER_FROM_PX = 7;
const SHARE_FROM_PX = 10;

/** @typedef {{full: string, partial: string, empty: string, unseen: string, conflicting: string, ink: string, paper: string, pale: string, blank: string}} Palette */

export class Symbols {
  /** @type {Map<string, HTMLCanvasElement>} */ #kept = new Map();
  /** Of each row, as it was drawn last. @type {WeakMap<RodRow, {size: number, picture: HTMLCanvasElement}>} */ #last = new WeakMap();
  /** @type {Palette} */ #palette;

  /** @param {Palette} palette */
  constructor(palette) {
    this.#palette = palette;
  }

  /** The picture of a rod, its centre in the middle. @param {RodRow} rod @param {number} radius device px */
  of(rod, radius) {
    const size = Math.max(2, Math.round(radius));
    const last = this.#last.get(rod);
    if (last?.size === size) return last.picture;
    const picture = this.#find(rod, size);
    this.#last.set(rod, { size, picture });
    return picture;
  }

  /** @param {RodRow} rod @param {number} size */
  #find(rod, size) {
    const key = keyOf(rod, size);
    let picture = this.#kept.get(key);
    if (!picture) {
      if (this.#kept.size > 2000) this.#kept.clear();
      const label = size < SHARE_FROM_PX ? labelOf(rod).charAt(0) : labelOf(rod);
      picture = drawSymbol(rod, label, size, this.#palette);
      this.#kept.set(key, picture);
    }
    return picture;
  }
}

/** What is drawn alike. The label has the share, which is drawn also where it is too small to be written. @param {RodRow} rod @param {number} size */
export function keyOf(rod, size) {
  return `${verdictOf(rod)} ${labelOf(rod)} ${size} ${rod.by_hand ? 'by hand' : ''}`;
}

/** @param {RodRow} rod @param {string} label @param {number} r @param {Palette} palette */
function drawSymbol(rod, label, r, palette) {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 2 * r + 6;
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
  context.translate(r + 3, r + 3);
  context.lineWidth = Math.max(1.25, r / 9);
  const verdict = verdictOf(rod);
  SHAPES[verdict](context, r, palette, fillOf(rod) ?? 0);
  if (r >= LETTER_FROM_PX) write(context, label, r, palette[INKS[verdict]]);
  if (rod.by_hand) underline(context, r, palette);
  return canvas;
}

/** What the letter is written in. @type {Record<string, keyof Palette>} */
const INKS = { full: 'paper', conflicting: 'paper', partial: 'ink', empty: 'ink', unseen: 'unseen' };

/** @type {Record<string, (context: CanvasRenderingContext2D, r: number, palette: Palette, fill: number) => void>} */
const SHAPES = {
  full(context, r, palette) {
    disc(context, r);
    paint(context, palette.full, palette.paper);
  },
  partial(context, r, palette, fill) {
    disc(context, r);
    paint(context, palette.pale, null);
    context.beginPath();
    context.moveTo(0, 0);
    context.arc(0, 0, r, -Math.PI / 2, -Math.PI / 2 + 2 * Math.PI * fill);
    context.closePath();
    paint(context, palette.partial, null);
    disc(context, r);
    paint(context, null, palette.ink);
  },
  empty(context, r, palette) {
    disc(context, r);
    paint(context, palette.empty, palette.ink);
  },
  unseen(context, r, palette) {
    context.setLineDash([3, 3]);
    context.beginPath();
    context.rect(-r * 0.8, -r * 0.8, r * 1.6, r * 1.6);
    paint(context, palette.blank, palette.unseen); // legible over a rod that lies only partly in the picture
    context.setLineDash([]);
  },
  conflicting(context, r, palette) {
    const tip = r * 1.2;
    context.beginPath();
    context.moveTo(0, -tip);
    context.lineTo(tip, 0);
    context.lineTo(0, tip);
    context.lineTo(-tip, 0);
    context.closePath();
    paint(context, palette.conflicting, palette.paper);
  },
};

/** A bar below: a person said so. @param {CanvasRenderingContext2D} context @param {number} r @param {Palette} palette */
function underline(context, r, palette) {
  context.fillStyle = palette.paper;
  context.fillRect(-r, r - 3, 2 * r, 6);
  context.fillStyle = palette.ink;
  context.fillRect(-r + 1, r - 1, 2 * r - 2, 3);
}

/** @param {CanvasRenderingContext2D} context @param {number} r */
function disc(context, r) {
  context.beginPath();
  context.arc(0, 0, r, 0, 2 * Math.PI);
}

/** @param {CanvasRenderingContext2D} context @param {string | null} fill @param {string | null} stroke */
function paint(context, fill, stroke) {
  if (fill) {
    context.fillStyle = fill;
    context.fill();
  }
  if (stroke) {
    context.strokeStyle = stroke;
    context.stroke();
  }
}

/** @param {CanvasRenderingContext2D} context @param {string} label @param {number} r @param {string} ink */
function write(context, label, r, ink) {
  const share = label.length === 1 ? 1.25 : label.length === 2 ? 1 : 0.85;
  context.font = `600 ${Math.round(r * share)}px system-ui, sans-serif`;
  context.textAlign = 'center';
  context.textBaseline = 'middle';
  context.fillStyle = ink;
  context.fillText(label, 0, r * 0.06);
}
