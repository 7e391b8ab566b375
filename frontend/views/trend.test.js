import assert from 'node:assert/strict';
import { test } from 'node:test';
import { pathOf } from './trend.js';

test('a trend goes from the left to the right edge, from nothing at the bottom to the most at the top', () => {
  assert.equal(pathOf([0, 2, 4], 3), 'M0.0 17.0L32.0 9.0L64.0 1.0');
});

test('a gap is drawn as a gap, and the newest is at the right', () => {
  assert.equal(pathOf([1, null, 1], 5), 'M32.0 1.0M64.0 1.0');
  assert.equal(pathOf([], 5), '');
  assert.equal(pathOf([0], 5), 'M64.0 17.0');
});
