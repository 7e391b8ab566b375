// @ts-check
/**
 * A mosaic made here from the snapshots themselves: where the robots said that they were (raw), or as far as a moment
 * in the past (review). Later snapshots lie over earlier ones.
 *
 * What is asked for is a list; where it goes on from what is drawn, only the rest is drawn, else all of it anew.
 */

import { keyOf } from '../state/snapshotkey.js';
import { RasterCanvas } from './raster.js';

const AHEAD = 6;
const MOST_KEPT = 1000;

/** @typedef {(pose: PoseRow) => PlanePose | null} Placing where a snapshot is drawn; null: not at all */

export class SnapshotMosaic extends EventTarget {
  #pond;
  #camera;
  #urlOf;
  #placing;
  /** @type {PoseRow[]} */ #wanted = [];
  /** @type {string[]} */ #drawn = [];
  /** @type {Map<string, Promise<ImageBitmap | null>>} */ #images = new Map();
  #running = false;
  failed = 0;

  /**
   * @param {Raster} raster @param {Pond} pond @param {Camera} camera
   * @param {(key: {robot: string, boot: number, sequence: number}) => string} urlOf @param {Placing} placing
   */
  constructor(raster, pond, camera, urlOf, placing) {
    super();
    this.raster = new RasterCanvas(raster);
    this.#pond = pond;
    this.#camera = camera;
    this.#urlOf = urlOf;
    this.#placing = placing;
  }

  get wanted() { return this.#wanted.length; }
  get drawn() { return this.#drawn.length; }

  /** Show these and no others. @param {Iterable<PoseRow>} poses */
  show(poses) {
    this.#wanted = [...poses].filter((pose) => this.#placing(pose)).sort(byArrival);
    const goesOn = this.#drawn.every((key, i) => i < this.#wanted.length && key === keyOf(this.#wanted[i]));
    if (!goesOn) {
      this.#drawn = [];
      this.raster.clear();
    }
    if (!this.#running) void this.#run();
  }

  async #run() {
    this.#running = true;
    while (this.#drawn.length < this.#wanted.length) {
      const pose = this.#wanted[this.#drawn.length];
      this.#wanted.slice(this.#drawn.length, this.#drawn.length + AHEAD).forEach((next) => this.#image(next));
      const image = await this.#image(pose);
      if (this.#wanted[this.#drawn.length] !== pose) continue; // something else is asked for by now
      if (image) this.#draw(pose, image);
      this.#drawn.push(keyOf(pose));
      this.dispatchEvent(new Event('drawn'));
    }
    this.#running = false;
  }

  /** @param {PoseRow} pose */
  #image(pose) {
    const key = keyOf(pose);
    let image = this.#images.get(key);
    if (image) return image;
    image = fetch(this.#urlOf({ robot: pose.robot, boot: pose.boot ?? 0, sequence: pose.sequence }))
      .then((answer) => (answer.ok ? answer.blob() : Promise.reject(new Error(`${answer.status}`))))
      .then((blob) => createImageBitmap(blob))
      .catch(() => { this.failed += 1; return null; });
    this.#images.set(key, image);
    if (this.#images.size > MOST_KEPT) this.#images.delete(/** @type {string} */ (this.#images.keys().next().value));
    return image;
  }

  /** @param {PoseRow} pose @param {ImageBitmap} image */
  #draw(pose, image) {
    const at = /** @type {PlanePose} */ (this.#placing(pose));
    const { context, raster } = this.raster;
    const scale = this.#camera.metres_per_pixel / raster.metres_per_pixel;
    const [xPx, yPx] = [at.x_m / raster.metres_per_pixel, (this.#pond.height_m - at.y_m) / raster.metres_per_pixel];
    context.save();
    context.translate(xPx, yPx);
    context.rotate(-at.theta_rad);
    context.scale(scale, scale);
    context.drawImage(image, -image.width / 2, -image.height / 2);
    context.restore();
    const reach = Math.ceil((Math.hypot(image.width, image.height) * scale) / 2);
    this.raster.changed(Math.floor(xPx) - reach, Math.floor(yPx) - reach, 2 * reach + 1, 2 * reach + 1);
  }
}

/** @type {Placing} */
export function asSaid({ raw_x_m, raw_y_m, raw_theta_rad }) {
  return raw_x_m == null || raw_y_m == null ? null : { x_m: raw_x_m, y_m: raw_y_m, theta_rad: raw_theta_rad ?? 0 };
}

/** @type {Placing} */
export function asCorrected({ x_m, y_m, theta_rad, status }) {
  return status !== 'placed' || x_m === null || y_m === null || theta_rad === null ? null : { x_m, y_m, theta_rad };
}

/** @param {PoseRow} a @param {PoseRow} b */
function byArrival(a, b) {
  return (a.received_at ?? '').localeCompare(b.received_at ?? '') || a.sequence - b.sequence;
}
