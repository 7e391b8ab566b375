// @ts-check
/** One layer of the mosaic as pixels: patches go in, the map draws from its canvas. Raster pixels, right and down. */

export class RasterCanvas {
  /** @param {Raster} raster */
  constructor(raster) {
    this.raster = raster;
    this.canvas = document.createElement('canvas');
    this.canvas.width = raster.width_px;
    this.canvas.height = raster.height_px;
    const context = this.canvas.getContext('2d', { willReadFrequently: true });
    if (!context) throw new Error(`No canvas of ${raster.width_px} x ${raster.height_px} pixels can be made here.`);
    this.context = context;
  }

  /** Replace a rectangle; where the patch is transparent, nothing was seen. @param {Patch} patch @param {CanvasImageSource} image */
  paint({ x, y, width, height }, image) {
    this.context.clearRect(x, y, width, height);
    this.context.drawImage(image, x, y, width, height);
    if (image instanceof ImageBitmap) image.close();
  }

  clear() {
    this.context.clearRect(0, 0, this.canvas.width, this.canvas.height);
  }

  /** SHA-256 of all pixels (RGBA, row by row), hex; null where the browser has no digest (plain HTTP, not localhost). */
  async digest() {
    if (!globalThis.crypto?.subtle) return null;
    const { data } = this.context.getImageData(0, 0, this.canvas.width, this.canvas.height);
    const hash = await crypto.subtle.digest('SHA-256', data);
    return [...new Uint8Array(hash)].map((byte) => byte.toString(16).padStart(2, '0')).join('');
  }
}

/** @param {Patch} patch @returns {Promise<ImageBitmap>} */
export function decode(patch) {
  const options = /** @type {const} */ ({ colorSpaceConversion: 'none', premultiplyAlpha: 'none' });
  return createImageBitmap(new Blob([patch.content], { type: patch.mime }), options);
}
