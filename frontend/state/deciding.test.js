import assert from 'node:assert/strict';
import { test } from 'node:test';
import { decidingWords, isEarly, manyUncertain } from './deciding.js';

const of = (counts, state = 'open', span = null, heldAtMs = null) => ({ facts: { state, counts }, span, heldAtMs });

test('in the first minute many uncertain poses are told as still being decided, of those that were corrected at all', () => {
  const many = of({ snapshots: 100, uncertain: 26, pending: 60 }, 'open', [0, 9]);
  assert.equal(decidingWords(many, 59_999), 'Poses are still being decided: 26 of 40 are uncertain so far; more snapshots of the same places settle most of them.');
  assert.equal(decidingWords(of({ snapshots: 40, uncertain: 26 }, 'finishing', [0, 9]), 9e9), 'Poses are still being decided: 26 of 40 are uncertain so far; the last correction is under way.');
});

test('nothing is being decided where few are uncertain, in a review, or when all is over', () => {
  assert.deepEqual([of({ snapshots: 40, uncertain: 2 }), of({ snapshots: 40, uncertain: 26 }, 'finished'), of({ snapshots: 40, uncertain: 26 }, 'review', null, 1), of(undefined)].map((one) => decidingWords(one, 0)), [null, null, null, null]);
});

test('after it an uncertain pose is called so, and the judgement of the correction stands', () => {
  assert.equal(decidingWords(of({ snapshots: 40, uncertain: 26 }, 'open', [0, 9]), 60_000), null);
});

test('the first minute asks for no attention', () => {
  assert.deepEqual([isEarly(of({}), 9e9), isEarly(of({}, 'open', [0, 5]), 59_999), isEarly(of({}, 'open', [0, 5]), 60_000), isEarly(of({}, 'finished', [0, 1]), 2)], [true, true, false, false]);
  assert.ok(manyUncertain(of({ snapshots: 100, uncertain: 6 })));
});
