import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Inspection } from './inspection.js';

const raster = { metres_per_pixel: 0.001, width_px: 10, height_px: 10 };
const hello = (full, revision = 1) => ({ type: 'hello', session: 's', revision, full, raster });
const pose = (sequence, more = {}) => ({ robot: 'a', sequence, x_m: sequence, y_m: 0, theta_rad: 0, status: 'placed', ...more });

function inspection(...messages) {
  const made = new Inspection({ id: 's', name: 'n', state: 'running', revision: 0, pond: { width_m: 1, height_m: 1, rods: [{ id: 'R1' }] } });
  for (const message of messages) made.apply(message, 5000);
  return made;
}

test('a revision is held only once its session frame came', () => {
  const held = inspection(hello(true, 7), { type: 'rods', revision: 7, rods: [{ rod_id: 'R1', state: 'full', views: 1 }] });
  assert.equal(held.revision, null);
  held.apply({ type: 'session', revision: 7, state: 'running' }, 6000);
  assert.equal(held.revision, 7);
});

test('a full state replaces what was held; a partial one adds to it', () => {
  const held = inspection(hello(true), { type: 'rods', rods: [{ rod_id: 'R1', state: 'full', views: 1 }] }, { type: 'session', revision: 3 });
  held.apply(hello(false, 4), 0);
  assert.equal(held.rod('R1').state, 'full');
  assert.equal(held.revision, 3);
  held.apply(hello(true, 9), 0);
  assert.equal(held.rod('R1').state, 'unseen');
  assert.equal(held.revision, null);
});

test('a robot stands where its newest snapshot puts it, though older ones are corrected later', () => {
  const held = inspection({ type: 'poses', poses: [pose(2), pose(1)] });
  assert.equal(held.robots.get('a').pose.sequence, 2);
  held.apply({ type: 'poses', poses: [pose(2, { x_m: 2.5 })] }, 0);
  assert.equal(held.robots.get('a').pose.x_m, 2.5);
});

test('after a restart a robot counts from zero again, and is not taken for old', () => {
  const held = inspection({ type: 'poses', poses: [pose(90), pose(0, { boot: 1 })] });
  assert.equal(held.robots.get('a').pose.boot, 1);
});

test('a session frame without the layout does not lose it', () => {
  const held = inspection({ type: 'session', revision: 1, state: 'running', pond: { width_m: 1, height_m: 1 } });
  assert.equal(held.facts.pond.rods.length, 1);
});

test('the picture is as old as its newest snapshot, whenever the page learned of it and however it is corrected anew', () => {
  const held = inspection({ type: 'session', revision: 1 });
  assert.equal(held.ageMs(9000), null);
  const came = (sequence, at, more = {}) => ({ type: 'poses', poses: [pose(sequence, { received_at: new Date(at).toISOString(), ...more })] });
  held.apply(came(1, 3000), 8000);
  assert.equal(held.ageMs(9000), 6000);
  held.apply({ type: 'beat', at: new Date(8500).toISOString() }, 8000);
  held.apply(came(1, 3000, { x_m: 1.5 }), 9000);
  held.apply({ type: 'session', revision: 2, state: 'finished' }, 9000);
  assert.equal(held.ageMs(9000), 6500);
  assert.equal(held.facts.state, 'finished');
});

test('the difference of the clocks is learned from the beat', () => {
  const held = inspection({ type: 'beat', revision: 1, at: '1970-01-01T00:00:06.500Z' });
  assert.equal(held.clockSkewMs, 1500);
});

test('snapshots of the state that was there already are not fresh; those that come later are, once', () => {
  const held = inspection(hello(true), { type: 'poses', poses: [pose(1)] });
  assert.equal(held.fresh.length, 0);
  held.apply({ type: 'session', revision: 1 }, 0);
  held.apply({ type: 'poses', poses: [pose(1), pose(2)] }, 0);
  assert.deepEqual(held.fresh.map(({ sequence }) => sequence), [2]);
});

test('the mean drift is the root mean square over placed snapshots', () => {
  const moved = (sequence, x_m, status = 'placed') => pose(sequence, { x_m, y_m: 0, raw_x_m: 0, raw_y_m: 0, status });
  assert.equal(inspection({ type: 'poses', poses: [moved(1, 1), moved(2, 7), moved(3, 100, 'uncertain')] }).meanDriftM, 5);
  assert.equal(inspection().meanDriftM, null);
});

test('the span is from the first arrival to the last, whatever the order of telling', () => {
  const at = (sequence, s) => pose(sequence, { received_at: new Date(1000 * s).toISOString() });
  assert.deepEqual(inspection({ type: 'poses', poses: [at(2, 20), at(1, 5), pose(3), at(4, 9)] }).span, [5000, 20_000]);
  assert.equal(inspection().span, null);
});
