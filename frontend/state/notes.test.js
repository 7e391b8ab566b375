import assert from 'node:assert/strict';
import { test } from 'node:test';
import { aboutOf, noteOf, openFirst } from './notes.js';

const note = (id, more = {}) => ({ id, text: `n${id}`, by: 'Ada', at: `2030-01-01T00:00:0${id}Z`, rod_id: null, x_m: null, y_m: null, moment: null, closed_at: null, ...more });

test('what nobody dealt with comes first, then the newest', () => {
  const notes = [note(1), note(2, { closed_at: '2030-01-02T00:00:00Z' }), note(3)];
  assert.deepEqual(openFirst(notes).map(({ id }) => id), [3, 1, 2]);
});

test('a note says what it is about', () => {
  const about = [note(1), note(1, { rod_id: 'R7' }), note(1, { x_m: 0.123, y_m: 2 }), note(1, { moment: 'noon' })].map((one) => aboutOf(one, (at) => at));
  assert.deepEqual(about, ['', 'Rod R7', '0.12,\u00a02.00\u00a0m', 'At noon']);
});

test('what is sent holds the place or the moment that is shown', () => {
  const shown = { middle: { xM: 0.1, yM: 0.2 }, moment: 0 };
  assert.deepEqual(noteOf(' a ', 'all', shown), { text: 'a' });
  assert.deepEqual(noteOf('a', 'place', shown), { text: 'a', x_m: 0.1, y_m: 0.2 });
  assert.deepEqual(noteOf('a', 'moment', shown), { text: 'a', moment: '1970-01-01T00:00:00.000Z' });
  assert.deepEqual(noteOf('a', 'moment', { ...shown, moment: null }), { text: 'a' });
});
