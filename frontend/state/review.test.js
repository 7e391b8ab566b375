import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Inspection } from './inspection.js';
import { robotViews } from './robots.js';
import { Readings } from './readings.js';
import { Clock, asOf, endOf, standing } from './review.js';

const T = Date.parse('2030-01-01T12:00:00Z');
const at = (s) => new Date(T + 1000 * s).toISOString();
const pose = (robot, sequence, s, x_m, status = 'placed') => ({ robot, sequence, x_m, y_m: 0.5, theta_rad: 0, status, received_at: at(s) });

function inspection() {
  const camera = { width_px: 20, height_px: 10, metres_per_pixel: 0.01 };
  const rods = [{ id: 'early', x_m: 0.1, y_m: 0.5 }, { id: 'late', x_m: 0.9, y_m: 0.5 }];
  const made = new Inspection({ id: 's', name: 'n', state: 'open', revision: 0, camera, pond: { width_m: 1, height_m: 1, rods } });
  made.apply({ type: 'poses', poses: [pose('a', 1, 0, 0.1), pose('a', 2, 10, 0.5, 'uncertain'), pose('a', 3, 20, 0.9)] }, 0);
  made.apply({ type: 'rods', rods: ['early', 'late'].map((rod_id) => ({ rod_id, state: 'full', fill: 1, views: 1 })) }, 0);
  return made;
}

test('the past holds what had come by then, and nothing later', () => {
  const past = asOf(inspection(), T + 12_000);
  assert.deepEqual(past.facts.counts, { snapshots: 2, placed: 1, uncertain: 1, rejected: 0 });
  assert.equal(past.robots.get('a').pose.sequence, 2);
});

test('a rod nobody had looked at by then is not observed, whatever is known now', () => {
  const past = asOf(inspection(), T + 12_000);
  assert.deepEqual([past.rod('early').state, past.rod('late').state], ['full', 'unseen']);
});

test('ages are those of that moment', () => {
  const [robot] = robotViews(asOf(inspection(), T + 12_000), Date.now());
  assert.equal(robot.ageS, 2);
});

test('the coverage is that of the moment', () => {
  const [early, late] = [asOf(inspection(), T), asOf(inspection(), T + 20_000)];
  assert.ok(Math.abs(early.facts.coverage - 0.02) < 0.002);
  assert.ok(Math.abs(late.facts.coverage - 0.06) < 0.006);
});

test('a replay runs at its speed, holds at the end, and goes back to live only when asked', () => {
  const clock = new Clock();
  clock.tick(1000, 50_000);
  assert.ok(clock.live);
  clock.seek(10_000);
  clock.tick(1000, 50_000);
  assert.equal(clock.atMs, 10_000);
  clock.toggle(0);
  clock.speed = 20;
  clock.tick(1000, 50_000);
  assert.equal(clock.atMs, 30_000);
  clock.tick(1000, 50_000);
  clock.tick(1000, 50_000);
  assert.deepEqual([clock.atMs, clock.playing, clock.live], [50_000, false, false]);
  clock.goLive();
  assert.ok(clock.live);
});

test('from live, the first press holds the moment', () => {
  const clock = new Clock();
  clock.toggle(7000);
  assert.deepEqual([clock.atMs, clock.playing], [7000, false]);
});

test('a rod reads as it did at the moment, and is not observed before it was first read', () => {
  const kept = (s, state) => ({ rod_id: 'early', at: at(s), revision: s, state, fill: null, confidence: 0.9, views: 1, conflicting: false });
  const readings = new Readings([kept(1, 'empty'), kept(11, 'full')], T + 20_000);
  assert.deepEqual([0, 5, 12].map((s) => asOf(inspection(), T + 1000 * s, readings).rod('early').state), ['unseen', 'empty', 'full']);
});

test('an inspection that ended says when; one that goes on says nothing', () => {
  assert.equal(endOf({ state: 'finished', finished_at: '2030-01-01T12:00:05Z' }), 'finished 2030-01-01 12:00:05 UTC');
  assert.equal(endOf({ state: 'finishing', finished_at: null }), null);
});

test('a replay from a moment plays at once', () => {
  const clock = new Clock();
  clock.replay(5000);
  assert.deepEqual([clock.atMs, clock.playing, clock.live], [5000, true, false]);
});

test('the bar says final only of the end, review of any moment, and before both that the server is not heard', () => {
  const finished = { id: 's', name: 'n', state: 'finished', revision: 9, finished_at: at(60) };
  assert.deepEqual(standing('live', null, finished), { state: 'final', words: 'Final' });
  assert.deepEqual(standing('live', T + 5000, finished), { state: 'review', words: 'Review 12:00:05 UTC' });
  assert.deepEqual(standing('live', null, { ...finished, state: 'finishing' }), { state: 'final', words: 'Finishing…' });
  assert.deepEqual(standing('live', null, { ...finished, state: 'open' }), { state: 'live', words: null });
  assert.deepEqual(standing('disconnected', T, finished), { state: 'disconnected', words: null });
});
