import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Painted } from './painted.js';

test('a revision is on screen from the first drawing after it, or after a later one that took it in', () => {
  const painted = new Painted();
  painted.wait(3);
  assert.equal(painted.at(3), null);
  painted.drawn(100);
  painted.wait(7);
  painted.drawn(200);
  painted.drawn(300);

  assert.deepEqual([2, 3, 5, 7, 8].map((revision) => painted.at(revision)), [100, 100, 200, 200, null]);
});
