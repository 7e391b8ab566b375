// @ts-check
/**
 * The mosaic as it would be without correction: every snapshot where its robot said that it was. Made here, when
 * asked for, from the snapshots themselves, a few at a time, in the order in which they came.
 */

import { RasterCanvas } from './raster.js';

const AT_ONCE = 6;

export class RawMosaic extends EventTarget {
  /** @type {Set<string>} */ #known = new Set();
  /** @type {PoseRow[]} */ #queue = [];
  #busy = 0;
  /** @type {Promise<void>} */ #last = Promise.resolve();
  drawn = 0;
  failed = 0;

  /**
   * @param {Raster} raster @param {Pond} pond @param {Camera} camera
   * @param {(key: {robot: string, boot: number, sequence: number}) => string} urlOf
   */
  constructor(raster, pond, camera, urlOf) {
    super();
    this.raster = new RasterCanvas(raster);
    this.#pond = pond;
    this.#camera = camera;
    this.#urlOf = urlOf;
  }
  #pond;
  #camera;
  #urlOf;

  get wanted() { return this.#known.size; }

  /** Take what is new. @param {Iterable<PoseRow>} poses */
  update(poses) {
    for (const pose of poses) {
      const key = `${pose.robot}/${pose.boot ?? 0}/${pose.sequence}`;
      if (this.#known.has(key) || pose.raw_x_m == null || pose.raw_y_m == null) continue;
      this.#known.add(key);
      this.#queue.push(pose);
    }
    while (this.#busy < AT_ONCE && this.#queue.length) this.#load(/** @type {PoseRow} */ (this.#queue.shift()));
  }

  /** @param {PoseRow} pose */
  #load(pose) {
    this.#busy += 1;
    const picture = fetch(this.#urlOf({ robot: pose.robot, boot: pose.boot ?? 0, sequence: pose.sequence }))
      .then((answer) => (answer.ok ? answer.blob() : Promise.reject(new Error(`${answer.status}`))))
      .then((blob) => createImageBitmap(blob));
    picture.catch(() => {});
    this.#last = this.#last.then(() => picture).then((image) => this.#draw(pose, image), () => { this.failed += 1; }).finally(() => {
      this.#busy -= 1;
      this.update([]);
      this.dispatchEvent(new Event('drawn'));
    });
  }

  /** @param {PoseRow} pose @param {ImageBitmap} image */
  #draw(pose, image) {
    const { context, raster } = this.raster;
    const scale = this.#camera.metres_per_pixel / raster.metres_per_pixel;
    const xPx = /** @type {number} */ (pose.raw_x_m) / raster.metres_per_pixel;
    const yPx = (this.#pond.height_m - /** @type {number} */ (pose.raw_y_m)) / raster.metres_per_pixel;
    context.save();
    context.translate(xPx, yPx);
    context.rotate(-(pose.raw_theta_rad ?? 0));
    context.scale(scale, scale);
    context.drawImage(image, -image.width / 2, -image.height / 2);
    context.restore();
    const reach = Math.ceil((Math.hypot(image.width, image.height) * scale) / 2);
    this.raster.changed(Math.floor(xPx) - reach, Math.floor(yPx) - reach, 2 * reach + 1, 2 * reach + 1);
    image.close();
    this.drawn += 1;
  }
}
