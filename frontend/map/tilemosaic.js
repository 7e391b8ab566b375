// @ts-check
/** The mosaic of a session as it stood at a revision, drawn from tiles that are fetched as a view needs them. */

import { tileUrl } from '../api/ponds.js';
import { TILE_PX, levelFor, nearest, sideOf, tilesIn } from '../state/tilegrid.js';

const MOST_KEPT = 600;
const AGAIN_MS = 3000;

/** @typedef {import('../state/tilegrid.js').TileKey} TileKey */

export class TileMosaic extends EventTarget {
  #session;
  #revision;
  /** By key, the one used last at the end; null while it is on its way. @type {Map<string, HTMLImageElement | null>} */ #tiles = new Map();
  #waiting = 0;

  /** @param {string} session @param {number} revision @param {Raster} raster */
  constructor(session, revision, raster) {
    super();
    this.#session = session;
    this.#revision = revision;
    this.raster = raster;
  }

  /** Tiles on their way. */
  get waiting() { return this.#waiting; }

  /** Where a tile lacks, its coarser parent stands in. @param {CanvasRenderingContext2D} context @param {import('./frame.js').Frame} frame @param {Pond} pond */
  paint(context, frame, pond) {
    const size = this.raster.metres_per_pixel * frame.scale;
    const [x0, y0] = [frame.x(0), frame.y(pond.height_m)];
    const z = levelFor(this.raster, size);
    const side = sideOf(this.raster, z) * size;
    const part = { left: -x0 / size, top: -y0 / size, right: (frame.width - x0) / size, bottom: (frame.height - y0) / size };
    context.imageSmoothingEnabled = side / TILE_PX < 2;
    this.#want({ z: 0, x: 0, y: 0 });
    for (const tile of tilesIn(this.raster, z, part)) {
      this.#want(tile);
      const near = nearest(tile, (key) => this.#tiles.get(nameOf(key)) ?? undefined);
      if (!near) continue;
      const [left, top] = [Math.round(x0 + tile.x * side), Math.round(y0 + tile.y * side)]; // whole pixels: no seams
      const [right, bottom] = [Math.round(x0 + (tile.x + 1) * side), Math.round(y0 + (tile.y + 1) * side)];
      context.drawImage(near.found, near.left, near.top, near.size, near.size, left, top, right - left, bottom - top);
    }
  }

  /** @param {TileKey} tile */
  #want(tile) {
    const name = nameOf(tile);
    const kept = this.#tiles.get(name);
    if (kept !== undefined) {
      this.#tiles.delete(name);
      this.#tiles.set(name, kept);
      return;
    }
    this.#tiles.set(name, null);
    void this.#fetch(tile, name);
  }

  /** @param {TileKey} tile @param {string} name */
  async #fetch(tile, name) {
    const image = new Image();
    image.src = tileUrl(this.#session, this.#revision, tile);
    this.#waiting += 1;
    this.dispatchEvent(new Event('waiting'));
    try {
      await image.decode();
      this.#tiles.set(name, image);
      this.#forget();
    } catch {
      setTimeout(() => { this.#tiles.delete(name); this.#tell(); }, AGAIN_MS); // asked for again when it is drawn again
    }
    this.#waiting -= 1;
    this.#tell();
  }

  #tell() { this.dispatchEvent(new Event('drawn')); }

  #forget() {
    for (const [name, image] of this.#tiles) {
      if (this.#tiles.size <= MOST_KEPT) return;
      if (image) this.#tiles.delete(name);
    }
  }
}

/** @param {TileKey} tile */
function nameOf({ z, x, y }) {
  return `${z}/${x}/${y}`;
}
