import assert from 'node:assert/strict';
import { test } from 'node:test';
import { FLOOD, attentionOf } from './attention.js';

const inspection = ({ rods = [], counts = {}, state = 'running', jobs = [] } = {}) => ({
  facts: { state, counts }, rods: new Map(rods.map((rod) => [rod.rod_id, rod])), jobs: new Map(jobs.map((job) => [job.id, job])),
});
const disagreeing = (rod_id) => ({ rod_id, state: 'full', views: 4, conflicting: true });
const quiet = (name) => ({ name, hearing: 'silent', ageS: 14.2 });
const kinds = (notes) => notes.map(({ kind }) => kind);

test('where all is well nothing is said', () => {
  assert.deepEqual(attentionOf(inspection({ counts: { snapshots: 100, uncertain: 10 } }), [{ name: 'a', hearing: 'heard' }], { twiceShare: 0.5 }), []);
});

test('the worst comes first, and each says what to do', () => {
  const notes = attentionOf(inspection({ rods: [disagreeing('R1')], counts: { snapshots: 100, uncertain: 8, rejected: 3, pending: 60 } }),
    [quiet('bubble-3')], { twiceShare: 0.499, next: { xM: 1, yM: 2, rods: 4 } });

  assert.deepEqual(kinds(notes), ['rod-conflicting', 'robot-silent', 'correction-poor', 'behind', 'coverage-stale']);
  assert.ok(notes.every(({ advice }) => advice.endsWith('.')));
  assert.deepEqual([notes[0].rod, notes[1].robot, notes[4].place.xM], ['R1', 'bubble-3', 1]);
  assert.equal(notes[1].text, 'bubble-3 silent for 14 s');
});

test('a flood is told as one', () => {
  const many = Array.from({ length: FLOOD + 1 }, (_, i) => i);
  const notes = attentionOf(inspection({ rods: many.map((i) => disagreeing(`R${i}`)) }), many.map((i) => quiet(`b${i}`)), null);
  assert.deepEqual(notes.map(({ text }) => text), ['4 rods: looks disagree', '4 of 4 robots are silent']);
});

test('after the inspection nobody is called silent, and nothing stale', () => {
  assert.deepEqual(attentionOf(inspection({ state: 'finished' }), [quiet('a')], { twiceShare: 0 }), []);
});

test('a correction that failed is told above all', () => {
  const notes = attentionOf(inspection({ rods: [disagreeing('R1')], jobs: [{ id: 'j', state: 'failed', error: 'out of memory' }] }), [], null);
  assert.equal(notes[0].text, 'Correction failed: out of memory');
});
