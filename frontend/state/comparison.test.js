import assert from 'node:assert/strict';
import { test } from 'node:test';
import { CompareOptions, listed, wordsOf } from './comparison.js';

const rod = (rod_id, change, confidence, residual_px = 0.1) => ({ rod_id, change, confidence, residual_px });
const ANSWER = { rods: [rod('R10', 'emptied', 0.95), rod('R2', 'filled', 0.99, null), rod('R3', 'partly', 0.97)], not_comparable: [rod('R1', 'not_comparable', 0)] };
const names = (options) => listed(ANSWER, options).map(({ rod_id }) => rod_id).join(' ');
const options = (change) => Object.assign(new CompareOptions(), { base: 'a', with: 'b' }, change);

test('the whole view is in the address, and comes back from it', () => {
  const shown = options({ mode: 'swipe', front: 'base', at: 0.35, place: { xM: 0.25, yM: 0.1, metresPerPx: 0.0005 }, rod: 'R 1', only: new Set(['filled', 'partly']),
    sort: 'confidence', descending: true, shown: { changes: false, rods: true, grid: false } });

  const back = new CompareOptions().read(shown.address.slice(1));

  assert.equal(shown.address, '/?compare=a,b&mode=swipe&front=base&at=0.35&view=0.2500,0.1000,0.0005000&rod=R+1&only=filled,partly&sort=confidence&order=desc&show=-changes,rods');
  assert.deepEqual({ ...back }, { ...shown });
});

test('what an address says wrongly is passed over', () => {
  const read = new CompareOptions().read('?compare=a&mode=spin&at=7&view=1,x,0&only=&show=moon');
  assert.deepEqual([read.base, read.with, read.mode, read.at, read.place, read.only.size, read.shown.changes], ['a', '', 'side', 0.5, null, 0, true]);
  assert.equal(options({}).address, '/?compare=a,b');
});

test('the list is sorted by what is asked for, either way, and holds only what is asked for', () => {
  assert.equal(names(options({})), 'R2 R10 R3 R1');
  assert.equal(names(options({ sort: 'rod' })), 'R1 R2 R3 R10');
  assert.equal(names(options({ sort: 'confidence', descending: true })), 'R2 R3 R10 R1');
  assert.equal(names(options({ sort: 'residual', descending: true })), 'R10 R3 R1 R2');
  assert.equal(names(options({ only: new Set(['emptied']) })), 'R10');
});

test('one key shows the other of the two, alone', () => {
  const shown = options({});
  const seen = [0, 1, 2].map(() => { shown.flip(); return `${shown.mode} ${shown.front}`; });
  assert.deepEqual(seen, ['blink base', 'blink with', 'blink base']);
});

test('the swipe stays between its ends', () => {
  const shown = options({ at: 0.95 });
  shown.slide(1);
  shown.slide(1);
  assert.equal(shown.at, 1);
  shown.slide(-30);
  assert.equal(shown.at, 0);
});

test('a move names where to, and where from', () => {
  assert.equal(wordsOf({ word: 'moved', change: 'emptied', counterpart: 'R7' }), 'removed; may have moved to R7');
  assert.equal(wordsOf({ word: 'moved', change: 'filled', counterpart: 'R7' }), 'added; may have moved from R7');
  assert.equal(wordsOf({ word: null, change: 'not_comparable', counterpart: null }), '');
});
