import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Looks } from './looks.js';

const NOW = Date.parse('2030-01-01T12:00:00Z');
const camera = { width_px: 20, height_px: 10, metres_per_pixel: 0.01 }; // 0.2 m x 0.1 m
const rods = [{ id: 'left', x_m: 0.1, y_m: 0.5 }, { id: 'right', x_m: 0.9, y_m: 0.5 }, { id: 'by', x_m: 0.95, y_m: 0.5 }];
const pond = { width_m: 1, height_m: 1, rods };
const pose = (x_m, y_m, more = {}) => ({ robot: 'a', sequence: 1, x_m, y_m, theta_rad: 0, sigma_xy_m: 0.001, status: 'placed',
  received_at: '2030-01-01T11:59:50Z', ...more });

function counted(...poses) {
  const looks = new Looks(pond, camera);
  looks.count(poses, NOW);
  return looks;
}

test('a place is seen as often as footprints cover it', () => {
  const looks = counted(pose(0.5, 0.5), pose(0.55, 0.5));
  assert.deepEqual([0.42, 0.52, 0.63, 0.7].map((x) => looks.at(x, 0.5).looks), [1, 2, 1, 0]);
  assert.deepEqual([0.46, 0.54, 0.57].map((y) => looks.at(0.52, y).looks), [2, 2, 0]);
});

test('a turned snapshot covers a turned place', () => {
  const looks = counted(pose(0.5, 0.5, { theta_rad: Math.PI / 2 }));
  assert.deepEqual([looks.at(0.5, 0.58).looks, looks.at(0.58, 0.5).looks], [1, 0]);
});

test('the floor seen by the cells is the footprint', () => {
  const looks = counted(pose(0.5, 0.5, { theta_rad: 0.7 }));
  const seenM2 = looks.looks.reduce((sum, n) => sum + (n ? 1 : 0), 0) * looks.cellM ** 2;
  assert.ok(Math.abs(seenM2 - 0.02) < 0.0012, `${seenM2}`);
});

test('a snapshot that is not placed covers nothing, an uncertain one is a look that is not sure', () => {
  const looks = counted(pose(null, null, { theta_rad: null, status: 'rejected' }), pose(0.5, 0.5, { status: 'uncertain' }));
  assert.equal(looks.at(0.5, 0.5).looks, 1);
  assert.equal(looks.at(0.5, 0.5).sigmaM, Infinity);
});

test('outside the pond there is nothing', () => assert.equal(counted().at(1.2, 0.5), null));

test('rods seen at least twice in 30 minutes are counted by their share', () => {
  const old = { received_at: '2030-01-01T11:00:00Z' };
  assert.ok(Math.abs(counted(pose(0.1, 0.5), pose(0.1, 0.5)).twiceShare - 1 / 3) < 1e-12);
  assert.equal(counted(pose(0.1, 0.5), pose(0.1, 0.5, old)).twiceShare, 0);
});

test('the next look goes where it sees most rods that need one', () => {
  const next = counted(pose(0.1, 0.5)).next;
  assert.equal(next.rods, 2);
  assert.ok(next.xM >= 0.9);
  assert.equal(counted().next.rods, 2);
  assert.equal(counted(pose(0.1, 0.5), pose(0.1, 0.5), pose(0.92, 0.5), pose(0.92, 0.5)).next, null);
});
