import assert from 'node:assert/strict';
import { test } from 'node:test';
import { behindThen, behindWords, shortDigest } from './behind.js';
import { keyOf } from './snapshotkey.js';

const snapshots = [{ robot: 'a', boot: 0, sequence: 1 }, { robot: 'a', boot: 1, sequence: 1 }, { robot: 'b', boot: 0, sequence: 7 }];

test('a review holds the snapshots that had come by then, and live holds all that the server knows', () => {
  const poses = new Map([['a/0/1', {}]]);
  assert.deepEqual(behindThen(snapshots, { heldAtMs: 1, poses }), [snapshots[0]]);
  assert.deepEqual(behindThen(snapshots, { heldAtMs: null, poses }), snapshots);
  assert.equal(keyOf({ robot: 'a', sequence: 3 }), 'a/0/3');
});

test('the list says whether it is of then', () => {
  assert.deepEqual([behindWords(2, false), behindWords(2, true), behindWords(0, false), behindWords(0, true)],
    ['Snapshots behind it · 2', 'Snapshots behind it by then · 2', 'No snapshot shows this rod.', 'No snapshot had shown this rod by then.']);
});

test('of a digest twelve digits are told', () => assert.equal(shortDigest(`sha256:${'0123456789ab'.repeat(5)}cdef`), 'sha256:0123456789ab…'));
