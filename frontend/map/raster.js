// @ts-check
/**
 * One layer of the mosaic as pixels: patches go in, the map draws from its canvas. Raster pixels, right and down.
 *
 * A large raster keeps smaller copies of itself, each half the one before, so that a view of the whole pond does not
 * scale tens of millions of pixels down at every frame.
 */

const SMALLEST_PX = 2000;

export class RasterCanvas {
  /** @param {Raster} raster */
  constructor(raster) {
    this.raster = raster;
    this.#levels = [makeContext(raster.width_px, raster.height_px)];
    this.context = this.#levels[0];
    for (let { width, height } = this.canvas; Math.max(width, height) > SMALLEST_PX;) {
      [width, height] = [Math.ceil(width / 2), Math.ceil(height / 2)];
      this.#levels.push(makeContext(width, height));
    }
  }
  #levels;

  get canvas() { return this.context.canvas; }

  /** The smallest copy that is no coarser than the screen. @param {number} size screen pixels a raster pixel */
  copyFor(size) {
    const level = Math.min(this.#levels.length - 1, Math.max(0, Math.floor(Math.log2(1 / size))));
    return { canvas: this.#levels[level].canvas, factor: 2 ** level };
  }

  /** Replace a rectangle; where the patch is transparent, nothing was seen. @param {Patch} patch @param {CanvasImageSource} image */
  paint({ x, y, width, height }, image) {
    this.context.clearRect(x, y, width, height);
    this.context.drawImage(image, x, y, width, height);
    if (image instanceof ImageBitmap) image.close();
    this.changed(x, y, width, height);
  }

  /** Bring the smaller copies up to date in a rectangle. @param {number} x @param {number} y @param {number} width @param {number} height */
  changed(x, y, width, height) {
    let [left, top, right, bottom] = [x, y, x + width, y + height];
    for (let level = 1; level < this.#levels.length; level += 1) {
      [left, top, right, bottom] = [Math.floor(left / 2), Math.floor(top / 2), Math.ceil(right / 2), Math.ceil(bottom / 2)];
      const [w, h] = [right - left, bottom - top];
      this.#levels[level].clearRect(left, top, w, h);
      this.#levels[level].drawImage(this.#levels[level - 1].canvas, 2 * left, 2 * top, 2 * w, 2 * h, left, top, w, h);
    }
  }

  clear() {
    for (const context of this.#levels) context.clearRect(0, 0, context.canvas.width, context.canvas.height);
  }

  /** SHA-256 of all pixels (RGBA, row by row), hex; null where the browser has no digest (plain HTTP, not localhost). */
  async digest() {
    if (!globalThis.crypto?.subtle) return null;
    const { data } = this.context.getImageData(0, 0, this.canvas.width, this.canvas.height);
    const hash = await crypto.subtle.digest('SHA-256', data);
    return [...new Uint8Array(hash)].map((byte) => byte.toString(16).padStart(2, '0')).join('');
  }
}

/** @param {number} width @param {number} height */
function makeContext(width, height) {
  const context = Object.assign(document.createElement('canvas'), { width, height }).getContext('2d', { willReadFrequently: true });
  if (!context) throw new Error(`No canvas of ${width} x ${height} pixels can be made here.`);
  return context;
}

/** @param {Patch} patch @returns {Promise<ImageBitmap>} */
export function decode(patch) {
  const options = /** @type {const} */ ({ colorSpaceConversion: 'none', premultiplyAlpha: 'none' });
  return createImageBitmap(new Blob([patch.content], { type: patch.mime }), options);
}
