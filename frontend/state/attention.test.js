import assert from 'node:assert/strict';
import { test } from 'node:test';
import { attentionOf } from './attention.js';

const inspection = ({ counts = {}, state = 'running', jobs = [] } = {}) => ({ facts: { state, counts }, jobs: new Map(jobs.map((job) => [job.id, job])) });

test('where all is well nothing is said', () => {
  assert.deepEqual(attentionOf(inspection({ counts: { snapshots: 100, pending: 59 } })), []);
});

test('a correction that failed is told above a picture that is behind, each with what to do', () => {
  const notes = attentionOf(inspection({ counts: { pending: 60 }, jobs: [{ id: 'j', state: 'failed', error: 'out of memory' }] }));
  assert.deepEqual(notes.map(({ text }) => text), ['Correction failed: out of memory', 'The picture is 60 snapshots behind']);
  assert.ok(notes.every(({ advice }) => advice.endsWith('.')));
});
