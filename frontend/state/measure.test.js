import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Measure } from './measure.js';

test('the distance is that of the last two points', () => {
  const measure = new Measure();
  measure.add({ xM: 1, yM: 1 });
  assert.equal(measure.distanceM, null);
  measure.add({ xM: 4, yM: 5 });
  assert.equal(measure.distanceM, 5);
  measure.add({ xM: 0, yM: 0 });
  assert.equal(measure.distanceM, null);
});

test('put away, it forgets', () => {
  const measure = new Measure();
  measure.toggle();
  measure.add({ xM: 1, yM: 1 });
  measure.toggle();
  assert.deepEqual([measure.active, measure.points], [false, []]);
});
