// @ts-check
/** Which tiles of a mosaic a view needs, and where they lie. Raster pixels, right and down. Pure. */

export const TILE_PX = 256;

/** @typedef {{z: number, x: number, y: number}} TileKey */
/** @typedef {{left: number, top: number, right: number, bottom: number}} Rect */

/** The level at which a raster pixel is a tile's pixel; at level 0 one tile holds the whole raster. @param {Raster} raster */
export function finest({ width_px: width, height_px: height }) {
  return Math.max(0, Math.ceil(Math.log2(Math.max(width, height) / TILE_PX)));
}

/** The level whose pixels come nearest to the screen's. @param {Raster} raster @param {number} size screen pixels a raster pixel */
export function levelFor(raster, size) {
  const deepest = finest(raster);
  return Math.min(deepest, Math.max(0, deepest - Math.round(Math.log2(1 / size))));
}

/** Raster pixels along a tile's side. @param {Raster} raster @param {number} z */
export function sideOf(raster, z) {
  return TILE_PX * 2 ** (finest(raster) - z);
}

/** The tiles of a level that a part of the raster touches. @param {Raster} raster @param {number} z @param {Rect} part @returns {TileKey[]} */
export function tilesIn(raster, z, { left, top, right, bottom }) {
  const side = sideOf(raster, z);
  const [columns, rows] = [Math.ceil(raster.width_px / side), Math.ceil(raster.height_px / side)];
  const out = [];
  for (let y = Math.max(0, Math.floor(top / side)); y < Math.min(rows, Math.ceil(bottom / side)); y += 1) {
    for (let x = Math.max(0, Math.floor(left / side)); x < Math.min(columns, Math.ceil(right / side)); x += 1) out.push({ z, x, y });
  }
  return out;
}

/**
 * The nearest of a tile and its parents that is there, and which part of it is this tile (in its own pixels).
 * @template T
 * @param {TileKey} tile @param {(tile: TileKey) => T | undefined} find
 * @returns {{found: T, left: number, top: number, size: number} | null}
 */
export function nearest({ z, x, y }, find) {
  for (let up = 0; up <= z; up += 1) {
    const found = find({ z: z - up, x: x >> up, y: y >> up });
    const size = TILE_PX / 2 ** up;
    if (found !== undefined) return { found, left: (x % 2 ** up) * size, top: (y % 2 ** up) * size, size };
  }
  return null;
}
