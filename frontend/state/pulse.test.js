import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Pulse } from './pulse.js';

test('the rate is of the last 10 s', () => {
  const pulse = new Pulse();
  for (let i = 0; i < 200; i += 1) pulse.arrived([i * 50], i * 50 + 40);
  assert.equal(pulse.perSecond, 20);
  pulse.tick(199 * 50 + 40 + 5000);
  assert.equal(pulse.perSecond, 10);
  pulse.tick(60_000);
  assert.equal(pulse.perSecond, 0);
});

test('the delay is from the receipt to here, its median and what one in ten exceeds', () => {
  const pulse = new Pulse();
  assert.equal(pulse.latencyMs, null);
  pulse.arrived([1, 2, 3, 4, 5, 6, 7, 8, 9, 10].map((delay) => 1000 - 10 * delay), 1000);
  assert.deepEqual([pulse.latencyMs, pulse.worstMs], [60, 100]);
});

test('a receipt that is not told does not count as quick', () => {
  const pulse = new Pulse();
  pulse.arrived([NaN], 1000);
  assert.equal(pulse.latencyMs, null);
});

test('the trend has a point every 5 s, of the last 5 minutes, with a gap where nothing came', () => {
  const pulse = new Pulse();
  pulse.arrived([100], 200);
  for (let at = 0; at <= 400_000; at += 1000) {
    pulse.tick(at + 1000);
    pulse.sample(at + 1000, at === 0 ? 3 : 0);
    if (at === 0) assert.deepEqual(pulse.samples, [{ rate: 0.1, latencyMs: 100, queue: 3 }]);
  }
  assert.equal(pulse.samples.length, 60);
  assert.deepEqual(pulse.samples.at(-1), { rate: 0, latencyMs: null, queue: 0 });
});
