// @ts-check
/** A layer of `Looks` as a small picture, one pixel a cell, stretched over the pond; where nobody looked, nothing. */

import { CLASSES, classOf, valueOf } from '../state/classes.js';

/** @typedef {import('../state/looks.js').Looks} LooksGrid */

export class Overlay {
  #canvas = document.createElement('canvas');

  /**
   * @param {LooksGrid} looks @param {Exclude<import('../state/options.js').Layer, 'none'>} layer
   * @param {number} nowMs the server's clock @param {number} metresPerPixel of the raster
   * @param {Record<string, string>} colours by name, `#rrggbb`
   */
  fill(looks, layer, nowMs, metresPerPixel, colours) {
    const { classes } = CLASSES[layer];
    const palette = classes.map(({ colour }) => rgb(colours[colour]));
    const image = new ImageData(looks.columns, looks.rows);
    for (let i = 0; i < looks.looks.length; i += 1) {
      if (!looks.looks[i]) continue;
      const cell = { looks: looks.looks[i], newestMs: looks.newestMs[i], sigmaM: looks.sigmaM[i] };
      const [red, green, blue] = palette[classOf(classes, valueOf(layer, cell, nowMs, metresPerPixel))];
      image.data.set([red, green, blue, 255], 4 * i);
    }
    [this.#canvas.width, this.#canvas.height] = [looks.columns, looks.rows];
    this.#canvas.getContext('2d')?.putImageData(image, 0, 0);
    this.size = [looks.columns * looks.cellM, looks.rows * looks.cellM];
  }

  /** @param {CanvasRenderingContext2D} context @param {import('./frame.js').Frame} frame @param {Pond} pond @param {number} opacity 0 to 1 */
  paint(context, frame, pond, opacity) {
    if (!this.size) return;
    context.save();
    context.globalAlpha = opacity;
    context.beginPath();
    context.rect(frame.x(0), frame.y(pond.height_m), pond.width_m * frame.scale, pond.height_m * frame.scale);
    context.clip();
    context.imageSmoothingEnabled = false;
    context.drawImage(this.#canvas, frame.x(0), frame.y(pond.height_m), this.size[0] * frame.scale, this.size[1] * frame.scale);
    context.restore();
  }
}

/** @param {string} colour `#rrggbb` @returns {[number, number, number]} */
function rgb(colour) {
  const value = Number.parseInt(colour.slice(1), 16);
  return [value >> 16, (value >> 8) & 255, value & 255];
}
