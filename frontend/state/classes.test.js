import assert from 'node:assert/strict';
import { test } from 'node:test';
import { CLASSES, classOf, valueOf } from './classes.js';

const word = (layer, cell) => {
  const { classes } = CLASSES[layer];
  return classes[classOf(classes, valueOf(layer, cell, 3_600_000, 0.001))].word;
};
const cell = (more) => ({ looks: 1, newestMs: 3_600_000, sigmaM: 0.0001, ...more });

test('every value has a class, and its bounds are inclusive', () => {
  assert.deepEqual([1, 2, 3, 4, 7, 8, 900].map((looks) => word('looks', cell({ looks }))),
    ['once', '2 to 3 times', '2 to 3 times', '4 to 7 times', '4 to 7 times', '8 times or more', '8 times or more']);
});

test('what was seen over 30 minutes ago is stale', () => {
  assert.equal(word('age', cell({ newestMs: 3_600_000 - 1_800_000 })), 'under 30 min');
  assert.equal(word('age', cell({ newestMs: 0 })), 'older: stale');
});

test('a place that no sure look shows is told apart', () => {
  assert.equal(word('uncertainty', cell({ sigmaM: 0.0004 })), 'under half a pixel');
  assert.equal(word('uncertainty', cell({ sigmaM: Infinity })), 'no sure look');
});
