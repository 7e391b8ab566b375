import assert from 'node:assert/strict';
import { test } from 'node:test';
import { spots } from './labels.js';

const SIZE = { height: 12, aside: 10, above: 8, across: 300 };

test('a name stands right of and above what it names', () => {
  assert.deepEqual(spots([{ x: 50, y: 60, width: 40 }], SIZE), [{ x: 60, y: 52 }]);
});

test('at the right edge it stands on the left', () => {
  assert.deepEqual(spots([{ x: 280, y: 60, width: 40 }], SIZE), [{ x: 230, y: 52 }]);
});

test('two that would cover one another stand on different sides', () => {
  const [first, second] = spots([{ x: 50, y: 60, width: 40 }, { x: 70, y: 62, width: 40 }], SIZE);
  assert.deepEqual(first, { x: 60, y: 52 });
  assert.deepEqual(second, { x: 20, y: 54 });
});

test('where every side is taken the first is used all the same', () => {
  const same = { x: 150, y: 60, width: 40 };
  const all = spots([same, same, same, same, same], SIZE);
  assert.equal(new Set(all.slice(0, 4).map((s) => `${s.x} ${s.y}`)).size, 4);
  assert.deepEqual(all[4], all[0]);
});
