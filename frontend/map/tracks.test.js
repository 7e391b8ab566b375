import assert from 'node:assert/strict';
import { test } from 'node:test';
import { gridStep } from './tracks.js';

test('grid lines are 1, 2 or 5 of a power of ten apart, and at least 60 pixels', () => {
  assert.deepEqual([1, 100, 1000, 2000, 7000].map(gridStep).map((step) => Number(step.toPrecision(3))), [100, 1, 0.1, 0.05, 0.01]);
  for (let px = 3; px < 1e5; px *= 1.37) assert.ok(gridStep(px) * px >= 60 * (1 - 1e-9));
});
