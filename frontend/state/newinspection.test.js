import assert from 'node:assert/strict';
import { test } from 'node:test';
import { documentOf, readLayout } from './newinspection.js';

const POND = { width_m: 1, height_m: 2, rods: [] };

test('a file may be a whole session.json or a layout alone', () => {
  assert.deepEqual(readLayout(JSON.stringify({ pond: POND, camera: 1 }), 'a.json'), { pond: POND, camera: 1 });
  assert.deepEqual(readLayout(JSON.stringify(POND), 'a.json'), { pond: POND });
});

test('what is wrong with a file is said with its name', () => {
  for (const [text, words] of [['{', /a\.json is not JSON/], ['[]', /must be an object/], ['{"x": 1}', /neither "pond" nor/]]) {
    assert.throws(() => readLayout(text, 'a.json'), words);
  }
});

test('what the file does not say comes from the earlier inspection, and nothing else of it', () => {
  const earlier = { id: 'x', name: 'old', camera: { width_px: 8 }, pond: { width_m: 9 }, pose_noise: null };
  assert.deepEqual(documentOf('new', { pond: POND }, earlier), { format: 'pond-session/1', name: 'new', camera: { width_px: 8 }, pond: POND });
});

test('a start without a layout or a camera says what to choose', () => {
  assert.throws(() => documentOf('new', null, null), /Choose a layout/);
  assert.throws(() => documentOf('new', { pond: POND }, null), /nothing of the camera/);
});
