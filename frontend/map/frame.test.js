import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Frame, footprint, inPicture } from './frame.js';

const frame = new Frame({ widthPx: 200, heightPx: 100, centreM: [1, 1], metresPerPx: 0.01, pixelRatio: 2 });

test('the centre is in the middle, x goes right and y goes up', () => {
  assert.deepEqual([frame.x(1), frame.y(1)], [200, 100]);
  assert.deepEqual([frame.x(1.5), frame.y(1.25)], [300, 50]);
});

test('a disc is seen while any of it may be', () => {
  assert.ok(frame.sees(2.05, 1, 0.1));
  assert.ok(!frame.sees(2.2, 1, 0.1));
});

test('a picture turned by a quarter has its upper left corner at the lower left', () => {
  const camera = { width_px: 4, height_px: 2, metres_per_pixel: 1 };
  const corners = footprint({ x_m: 10, y_m: 20, theta_rad: Math.PI / 2 }, camera);
  const rounded = corners.map((corner) => corner.map((value) => Math.round(value * 1e9) / 1e9));
  assert.deepEqual(rounded, [[9, 18], [9, 22], [11, 22], [11, 18]]);
});

test('a place is found in the picture: the corners are its corners, whatever way it is turned', () => {
  const camera = { width_px: 4, height_px: 2, metres_per_pixel: 0.5 };
  const pose = { x_m: 10, y_m: 20, theta_rad: 0.7 };
  const found = footprint(pose, camera).map(([xM, yM]) => inPicture(pose, camera, xM, yM)).map(({ u, v }) => [u, v].map((share) => Math.abs(Math.round(share * 1e9) / 1e9)));
  assert.deepEqual(found, [[0, 0], [1, 0], [1, 1], [0, 1]]);
});

test('turned by a quarter, what lies above the middle in the pond lies right of it in the picture', () => {
  const { u, v } = inPicture({ x_m: 0, y_m: 0, theta_rad: Math.PI / 2 }, { width_px: 10, height_px: 10, metres_per_pixel: 1 }, 0, 2);
  assert.ok(Math.abs(u - 0.7) < 1e-12 && Math.abs(v - 0.5) < 1e-12);
});
