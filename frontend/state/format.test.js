import assert from 'node:assert/strict';
import { readFileSync, readdirSync } from 'node:fs';
import { test } from 'node:test';
import * as format from './format.js';

/** With ordinary spaces, for the eye. */
const plain = (text) => text.replaceAll('\u00a0', ' ');

test('ages', () => {
  assert.deepEqual([0.04, 9.9, 9.96, 119, 600, 7200, 200_000, null, NaN].map((s) => plain(format.age(s))),
    ['0.0 s', '9.9 s', '10 s', '119 s', '10 min', '2 h', '2 days', '–', '–']);
});

test('almost all is never written as all', () => {
  assert.deepEqual([1, 0.996, 0.914, 0, null].map((value) => plain(format.percent(value))), ['100 %', '> 99 %', '91 %', '0 %', '–']);
});

test('lengths carry the unit that suits them', () => {
  assert.deepEqual([0.000002, 0, 0.00012, 0.021, 1.5, null].map((m) => plain(format.length(m))), ['< 0.01 mm', '0.00 mm', '0.12 mm', '2.1 cm', '1.50 m', '–']);
});

test('angles are degrees', () => assert.equal(format.angle(Math.PI / 2), '90.0°'));

test('what is below nothing has a minus, and what rounds to nothing has none', () => {
  assert.deepEqual([format.angle(-Math.PI), format.fixed(-0.004, 2), format.fixed(-0.006, 2), plain(format.length(-0.021))], ['−180.0°', '0.00', '−0.01', '−2.1 cm']);
  assert.equal(plain(format.place(-0.0312, 1)), 'x −0.031 m   y 1.000 m');
  assert.equal(plain(format.spot(-0.5, -0.001)), '−0.50, 0.00 m');
});

test('a figure, its sign and its unit are never parted at the end of a line', () => {
  for (const text of [format.age(3), format.delay(20), format.percent(0.999), format.length(0.000001), format.figure(1, 2, 'px'), format.spot(1, 2)]) assert.doesNotMatch(text, / /);
  assert.equal(plain(format.sentence('65 % of 40 snapshots, > 3 mm off, -0.2 m')), '65 % of 40 snapshots, > 3 mm off, −0.2 m');
  assert.equal(format.sentence('65 % of 40 snapshots, 5 months, bubble-3 on 2026-01-31'), '65\u00a0% of 40 snapshots, 5 months, bubble-3 on 2026-01-31');
});

test('no part of the page rounds for the eye by itself', () => {
  const apart = new Set(['format.js', 'address.js', 'ring.js', 'trend.js']); // addresses and drawings
  const rounding = ['views', 'map', 'state'].flatMap((folder) => readdirSync(folder).filter((name) => name.endsWith('.js') && !name.endsWith('.test.js') && !apart.has(name))
    .filter((name) => readFileSync(`${folder}/${name}`, 'utf8').includes('.toFixed(')));
  assert.deepEqual(rounding, []);
});

test('a moment says its zone, whatever the zone of the reader', () => {
  assert.deepEqual(['2030-01-01T12:00:05.9+02:00', Date.UTC(2030, 0, 1), null, 'x'].map(format.moment),
    ['2030-01-01 10:00:05 UTC', '2030-01-01 00:00:00 UTC', '–', '–']);
});
