import assert from 'node:assert/strict';
import { test } from 'node:test';
import * as format from './format.js';

test('ages', () => {
  assert.deepEqual([0.04, 9.9, 9.96, 119, 600, 7200, 200_000, null, NaN].map(format.age),
    ['0.0 s', '9.9 s', '10 s', '119 s', '10 min', '2 h', '2 days', '–', '–']);
});

test('almost all is never written as all', () => {
  assert.deepEqual([1, 0.996, 0.914, 0, null].map((value) => format.percent(value)), ['100 %', '> 99 %', '91 %', '0 %', '–']);
});

test('lengths carry the unit that suits them', () => {
  assert.deepEqual([0.000002, 0, 0.00012, 0.021, 1.5, null].map(format.length), ['< 0.01 mm', '0.00 mm', '0.12 mm', '2.1 cm', '1.50 m', '–']);
});

test('angles are degrees', () => assert.equal(format.angle(Math.PI / 2), '90.0°'));

test('a moment says its zone, whatever the zone of the reader', () => {
  assert.deepEqual(['2030-01-01T12:00:05.9+02:00', Date.UTC(2030, 0, 1), null, 'x'].map(format.moment),
    ['2030-01-01 10:00:05 UTC', '2030-01-01 00:00:00 UTC', '–', '–']);
});
