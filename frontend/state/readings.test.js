import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Readings } from './readings.js';

const T = Date.parse('2030-01-01T12:00:00Z');
const kept = (s, revision, state) => ({ rod_id: 'A1', at: new Date(T + 1000 * s).toISOString(), revision, state, fill: null, confidence: 0.9, views: revision, conflicting: false });
const now = (by_hand = null) => ({ rod_id: 'A1', state: 'full', fill: 1, confidence: 0.99, views: 9, by_hand });
const readings = new Readings([kept(10, 1, 'empty'), kept(20, 2, 'full')], T + 30_000);

test('a rod reads as the last revision before the moment had it', () => {
  assert.deepEqual([10, 19, 20, 30].map((s) => readings.at(now(), T + 1000 * s).state), ['empty', 'empty', 'full', 'full']);
});

test('before its first reading a rod had none', () => assert.equal(readings.at(now(), T + 9000), null));

test('what a person said counts from when it was said', () => {
  const said = { state: 'partial', at: new Date(T + 15_000).toISOString() };
  assert.deepEqual([14, 15].map((s) => readings.at(now(said), T + 1000 * s).by_hand?.state ?? null), [null, 'partial']);
});

test('a rod of which nothing earlier was kept reads as now', () => {
  assert.equal(new Readings([], T).at(now(), T).state, 'full');
});
