import assert from 'node:assert/strict';
import { test } from 'node:test';
import { isWeak, robotViews, saidOf } from './robots.js';

const NOW = 100_000;
function views({ heardAt = NOW, state = 'running', skew = 0, pose = {} } = {}) {
  const row = { robot: 'bubble-2', x_m: 0.3, y_m: 0.4, raw_x_m: 0, raw_y_m: 0, ...pose };
  return robotViews({ robots: new Map([['bubble-2', { pose: row, heardAt }]]), facts: { state }, serverMs: (now) => now + skew }, NOW);
}

test('a robot unheard for 8 s while the inspection runs is silent', () => {
  assert.equal(views({ heardAt: NOW - 7999 })[0].hearing, 'heard');
  assert.equal(views({ heardAt: NOW - 8000 })[0].hearing, 'silent');
});

test('after the inspection nobody is silent', () => {
  assert.equal(views({ heardAt: 0, state: 'finished' })[0].hearing, 'ended');
});

test('ages are by the server clock', () => {
  assert.equal(views({ heardAt: NOW + 60_000, skew: 62_000 })[0].ageS, 2);
});

test('an age that is not known is not taken for fresh', () => {
  assert.equal(views({ heardAt: NaN })[0].hearing, 'unknown');
});

test('the drift is how far the correction moved the pose', () => {
  assert.equal(views()[0].driftM, 0.5);
  assert.equal(views({ pose: { x_m: null, y_m: null } })[0].driftM, null);
});

test('robots are in the order of their numbers', () => {
  const robots = new Map(['r10', 'r2', 'r1'].map((name) => [name, { pose: {}, heardAt: 0 }]));
  assert.deepEqual(robotViews({ robots, facts: { state: 'running' }, serverMs: (now) => now }, 0).map(({ name }) => name), ['r1', 'r2', 'r10']);
});

test('while the server is not heard nobody knows who is silent', () => {
  const robots = new Map([['a', { pose: {}, heardAt: 0 }]]);
  const [view] = robotViews({ robots, facts: { state: 'running' }, serverMs: (now) => now }, NOW, false);
  assert.deepEqual([view.hearing, view.ageS], ['unknown', 100]);
});

test('a robot whose snapshots wait for their correction is behind, unless the server says that it is silent', () => {
  const row = { robot: 'a', x_m: null, y_m: null };
  const alarms = { limits: {}, isActive: (kind, subject) => kind === 'robot-silent' && subject === 'b' };
  const inspection = (pending) => ({ robots: new Map(['a', 'b'].map((name) => [name, { pose: row, heardAt: NOW - 9000 }])), alarms,
    facts: { state: 'open', counts: { pending } }, serverMs: (now) => now });
  assert.deepEqual(robotViews(inspection(40), NOW).map(({ hearing }) => hearing), ['behind', 'silent']);
  assert.deepEqual(robotViews(inspection(0), NOW).map(({ hearing }) => hearing), ['silent', 'silent']);
  assert.deepEqual(robotViews({ ...inspection(40), heldAtMs: NOW }, NOW).map(({ hearing }) => hearing), ['silent', 'silent']);
});

test('what a robot says of itself is told, and what it does not say is not', () => {
  assert.equal(saidOf({ battery: 0.836, link_loss: 0.03, image_quality: 0.9 }), 'battery 84\u00a0% · loss 3\u00a0% · image 90\u00a0%');
  assert.equal(saidOf({ link_loss: 0 }), 'loss 0\u00a0%');
  assert.equal(saidOf({}), '');
  assert.deepEqual([{ battery: 0.19 }, { link_loss: 0.31 }, { battery: 0.2, link_loss: 0.3 }, {}].map(isWeak), [true, true, false, false]);
});
