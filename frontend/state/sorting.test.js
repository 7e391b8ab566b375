import assert from 'node:assert/strict';
import { test } from 'node:test';
import { sorted } from './sorting.js';

const shown = (rows) => rows.map(([{ show }]) => show);

test('names are ordered with their numbers as numbers', () => {
  const rows = ['R10', 'R2', 'R1'].map((show) => [{ show }]);
  assert.deepEqual(shown(sorted(rows, 0, false)), ['R1', 'R2', 'R10']);
  assert.deepEqual(shown(sorted(rows, 0, true)), ['R10', 'R2', 'R1']);
});

test('what has nothing to order by is last, either way', () => {
  const rows = [['a', null], ['b', 2], ['c', 10]].map(([show, by]) => [{ show }, { show: '', by }]);
  assert.deepEqual(shown(sorted(rows, 1, false)), ['b', 'c', 'a']);
  assert.deepEqual(shown(sorted(rows, 1, true)), ['c', 'b', 'a']);
});

test('rows that are alike stay as they were', () => {
  const rows = ['z', 'y'].map((show) => [{ show }, { show: 'same' }]);
  assert.deepEqual(shown(sorted(rows, 1, false)), ['z', 'y']);
});
