import assert from 'node:assert/strict';
import { test } from 'node:test';
import { partsOf } from './trend.js';

test('the parts of a bar follow each other and fill it', () => {
  const parts = partsOf({ rods: 8, counts: { full: 4, partial: 1, empty: 2, not_observed: 1 } });
  assert.deepEqual(parts.map(({ state, from, size }) => [state, from, size]), [['full', 0, 0.5], ['partial', 0.5, 0.125], ['empty', 0.625, 0.25], ['not_observed', 0.875, 0.125]]);
});

test('a pond without rods has an empty bar', () => {
  assert.ok(partsOf({ rods: 0, counts: { full: 0, partial: 0, empty: 0, not_observed: 0 } }).every(({ size }) => size === 0));
});
