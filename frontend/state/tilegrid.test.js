import assert from 'node:assert/strict';
import { test } from 'node:test';
import { finest, levelFor, nearest, sideOf, tilesIn } from './tilegrid.js';

const raster = { width_px: 4000, height_px: 3000, metres_per_pixel: 0.001 }; // 12 megapixels: levels 0 to 4
const WHOLE = { left: 0, top: 0, right: 4000, bottom: 3000 };

test('at level 0 one tile holds the whole raster, and at the finest a tile is 256 of its pixels', () => {
  assert.equal(finest(raster), 4);
  assert.deepEqual(tilesIn(raster, 0, WHOLE), [{ z: 0, x: 0, y: 0 }]);
  assert.equal(sideOf(raster, 4), 256);
  assert.equal(tilesIn(raster, 4, WHOLE).length, 16 * 12);
  assert.equal(finest({ width_px: 100, height_px: 80, metres_per_pixel: 1 }), 0);
});

test('the level follows the scale of the screen', () => {
  assert.equal(levelFor(raster, 1), 4);
  assert.equal(levelFor(raster, 8), 4);
  assert.equal(levelFor(raster, 0.25), 2);
  assert.equal(levelFor(raster, 0.001), 0);
});

test('a view of a part needs the tiles that it touches, and none outside of the raster', () => {
  const tiles = tilesIn(raster, 4, { left: -500, top: 250, right: 300, bottom: 257 });
  assert.deepEqual(tiles, [{ z: 4, x: 0, y: 0 }, { z: 4, x: 1, y: 0 }, { z: 4, x: 0, y: 1 }, { z: 4, x: 1, y: 1 }]);
  assert.deepEqual(tilesIn(raster, 4, { left: 5000, top: 0, right: 6000, bottom: 10 }), []);
});

test('while a tile is on its way its part of a coarser one stands in', () => {
  const there = ({ z, x, y }) => (z === 2 && x === 1 && y === 2 ? 'coarse' : undefined);
  assert.deepEqual(nearest({ z: 4, x: 6, y: 9 }, there), { found: 'coarse', left: 128, top: 64, size: 64 });
  assert.deepEqual(nearest({ z: 2, x: 1, y: 2 }, there), { found: 'coarse', left: 0, top: 0, size: 256 });
  assert.equal(nearest({ z: 3, x: 0, y: 0 }, there), null);
});
