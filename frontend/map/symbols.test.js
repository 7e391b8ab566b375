import assert from 'node:assert/strict';
import { test } from 'node:test';
import { keyOf } from './symbols.js';

const partial = (fill) => ({ rod_id: '', state: 'partial', fill, confidence: 1, views: 1 });

test('rods of different shares are different pictures, however small', () => {
  assert.notEqual(keyOf(partial(0.25), 8), keyOf(partial(0.75), 8));
  assert.equal(keyOf(partial(0.251), 8), keyOf(partial(0.249), 8));
});
