import assert from 'node:assert/strict';
import { test } from 'node:test';
import { ACTS, ACT_WORDS, Alarms, FLOOD, adviceOf, callOf, levelOf, messageOf, nameOf, open, stateWords } from './alarms.js';
import { Inspection } from './inspection.js';
import { asOf } from './review.js';
import { robotViews } from './robots.js';

const alarm = (id, more = {}) => ({
  id, kind: 'robot-silent', subject: `bubble-${id}`, title: 'Robot silent', severity: 500, message: '', advice: '', active: true, acknowledged: false,
  latched: false, suppressed: false, out_of_service: false, retained: true, quiet: false, rings: true, shelved_until: null,
  since: `2026-01-01T08:00:0${id % 10}.000Z`, occurrences: 1, acts: ['acknowledge', 'shelve'], comment: null, ...more,
});
const book = (...alarms) => { const made = new Alarms(); for (const one of alarms) made.apply(one); return made; };
const ids = (alarms) => alarms.map(({ id }) => id);

test('those that ring come first, then the more severe, then the newest', () => {
  const seen = { acknowledged: true, rings: false };
  assert.deepEqual(ids(book(alarm(1), alarm(2, { severity: 900, ...seen }), alarm(3), alarm(4, { severity: 700 }), alarm(5, seen)).current), [4, 3, 1, 2, 5]);
});

test('what is shelved, suppressed or out of service is set aside and does not count', () => {
  const made = book(alarm(1), alarm(2, { quiet: true, rings: false, shelved_until: 'until-clear' }));
  assert.deepEqual([ids(made.current), ids(made.aside), made.ringing], [[1], [2], 1]);
});

test('an alarm that is over and done with is gone, and all are forgotten when they come anew', () => {
  const made = book(alarm(1), alarm(2));
  made.apply(alarm(1, { retained: false, rings: false }));
  assert.deepEqual([made.get(1), ids(made.current)], [undefined, [2]]);
  made.clear();
  assert.equal(made.current.length, 0);
});

test('more than a few of a kind are told as one, with how many ring', () => {
  const many = Array.from({ length: FLOOD + 1 }, (_, i) => alarm(i + 1, { kind: 'rod-changed', title: 'Rod changed', severity: 900, rings: i > 1, acknowledged: i < 2 }));
  const groups = book(...many, alarm(9)).groups;
  assert.deepEqual(groups.map(({ kind, flood, ringing, alarms }) => [kind, flood, ringing, alarms.length]), [['rod-changed', true, 4, 6], ['robot-silent', false, 1, 1]]);
});

test('a severity has a letter beside its colour', () => {
  assert.deepEqual([1, 499, 500, 799, 800, 1000].map((severity) => levelOf(severity).letter).join(''), 'LLMMHH');
  assert.equal(book(alarm(1, { severity: 300 }), alarm(2, { severity: 900, rings: false })).worst.name, 'low');
  assert.equal(book().worst, null);
});

test('where an alarm stands is said in words', () => {
  assert.equal(stateWords(alarm(1)), 'active, not acknowledged');
  assert.equal(stateWords(alarm(1, { active: false, acknowledged: true, latched: true })), 'returned to normal, acknowledged, latched until it is reset');
  assert.equal(stateWords(alarm(1, { shelved_until: 'until-clear', suppressed: true, out_of_service: true })),
    'active, not acknowledged, shelved until it is over, suppressed, out of service');
  assert.equal(stateWords(alarm(1, { shelved_until: '10:00' }), (at) => `ten (${at})`), 'active, not acknowledged, shelved until ten (10:00)');
  assert.deepEqual([nameOf(alarm(1)), nameOf(alarm(1, { subject: '' }))], ['Robot silent · bubble-1', 'Robot silent']);
});

test('an act is for those alarms that allow it', () => {
  assert.deepEqual(ids(open([alarm(1), alarm(2, { acts: ['shelve'] })], 'acknowledge')), [1]);
  assert.ok(ACTS.every((act) => ACT_WORDS[act]));
});

const facts = { id: 's', name: 'n', state: 'open', revision: 0 };
const heard = { type: 'poses', poses: [{ robot: 'a', sequence: 1, x_m: 0, y_m: 0, theta_rad: 0, status: 'placed', received_at: '1970-01-01T00:00:00.000Z' }] };

test('the feed tells alarms, and tells them all anew at each hello', () => {
  const held = new Inspection(facts);
  held.apply({ type: 'alarm', ...alarm(1) }, 0);
  assert.equal(held.alarms.ringing, 1);
  held.apply({ type: 'hello', full: false, raster: null, revision: 1 }, 0);
  assert.equal(held.alarms.ringing, 0);
});

test('a robot is silent from the limit that the server has', () => {
  const held = new Inspection(facts);
  held.apply(heard, 0);
  const hearing = (ms, of = held) => robotViews(of, ms)[0].hearing;
  assert.deepEqual([hearing(7900), hearing(8000)], ['heard', 'silent']);
  held.alarms.limits = { robot_silent_s: 30 };
  assert.deepEqual([hearing(29_900), hearing(30_000)], ['heard', 'silent']);
  assert.equal(asOf(held, 100).alarms, held.alarms, 'a review knows the limit too');
});

test('one that returned to normal and was not acknowledged is told as that: below what is active, and never as active', () => {
  const over = { active: false, severity: 900, message: 'About 65 % is not sure.', advice: 'Check the water.' };
  const made = book(alarm(1), alarm(2, over), alarm(3, { acknowledged: true, rings: false }));
  assert.deepEqual([ids(made.current), made.worst.name, made.ringing, made.count('active'), made.count('returned')], [[1, 2, 3], 'medium', 2, 1, 1]);
  assert.deepEqual(made.current.map(callOf), ['active', 'returned', 'answered']);
  assert.equal(stateWords(alarm(2, over)), 'returned to normal, not acknowledged');
  assert.deepEqual([messageOf(alarm(2, over)), adviceOf(alarm(2, over))], ['Was: About 65 % is not sure.', 'Over: acknowledge it.']);
  assert.equal(adviceOf(alarm(2, { ...over, latched: true })), 'Check the water. Over: acknowledge it, then reset it.');
  assert.equal(adviceOf(alarm(2, { ...over, active: true })), 'Check the water.');
  assert.equal(adviceOf(alarm(2, { ...over, active: true, kind: 'correction-poor' }), true), 'Wait: poses are still being decided. If it stays: Check the water.');
  assert.equal(adviceOf(alarm(2, { ...over, active: true }), true), 'Check the water.');
  assert.equal(book(alarm(2, over)).worst, null);
  assert.deepEqual(book(alarm(1), alarm(2, over)).groups.map(({ call, returned }) => [call, returned]), [['active', 1]]);
});
