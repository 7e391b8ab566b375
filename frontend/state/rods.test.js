import assert from 'node:assert/strict';
import { test } from 'node:test';
import { labelOf, machineVerdictOf, rodAt, tally, verdictOf } from './rods.js';

const rod = (state, more = {}) => ({ rod_id: 'R', state, fill: null, confidence: 1, views: 3, ...more });

test('a rod that no snapshot shows is never read as anything, whatever else is said of it', () => {
  assert.equal(verdictOf(rod('full', { views: 0 })), 'unseen');
  assert.equal(verdictOf(rod('unseen', { conflicting: true })), 'unseen');
});

test('looks that disagree are told before the state', () => {
  assert.equal(verdictOf(rod('full', { conflicting: true })), 'conflicting');
});

test('a person\'s word holds before the machine\'s, and both are told', () => {
  const judged = rod('empty', { fill: 0, conflicting: true, by_hand: { state: 'partial', fill: 0.4 } });
  assert.deepEqual([verdictOf(judged), machineVerdictOf(judged), labelOf(judged)], ['partial', 'conflicting', 'P40']);
  assert.equal(verdictOf(rod('unseen', { views: 0, by_hand: { state: 'full', fill: 1 } })), 'full');
});

test('the letter says the state, with the share where partly filled', () => {
  const labels = [rod('empty'), rod('full'), rod('partial', { fill: 0.416 }), rod('unseen'), rod('empty', { conflicting: true })].map(labelOf);
  assert.deepEqual(labels, ['E', 'F', 'P42', '?', 'C']);
});

test('rods of the layout never spoken of count as not observed', () => {
  const rows = { a: rod('full'), b: rod('unseen') };
  const counts = tally(['a', 'b', 'c'], (id) => rows[id] ?? rod('unseen'));
  assert.deepEqual(counts, { full: 1, partial: 0, empty: 0, conflicting: 0, unseen: 2 });
});

test('a click takes the nearest rod within its radius, or within reach', () => {
  const rods = [{ id: 'a', x_m: 0, y_m: 0, outer_radius_m: 0.1 }, { id: 'b', x_m: 0.15, y_m: 0, outer_radius_m: 0.1 }];
  assert.equal(rodAt(rods, 0.09, 0)?.id, 'b');
  assert.equal(rodAt(rods, 0.5, 0), null);
  assert.equal(rodAt(rods, 0.5, 0, 0.4)?.id, 'b');
});
