import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Options } from './options.js';

test('what is shown is written as words and read again', () => {
  const options = new Options();
  options.togglePicture();
  options.nextLayer();
  options.toggle('rods');
  options.toggle('grid');

  assert.equal(options.words(), 'raw,looks,-rods,grid');
  assert.equal(new Options().read(options.words()).words(), options.words());
});

test('at the start there is nothing to write', () => assert.equal(new Options().words(), ''));

test('words that are not known are passed over', () => assert.equal(new Options().read('cubist,none,-,raw').words(), 'raw'));

test('layers come round', () => {
  const options = new Options();
  const seen = [1, 2, 3, 4].map(() => { options.nextLayer(); return options.layer; });
  assert.deepEqual(seen, ['looks', 'age', 'uncertainty', 'none']);
});

test('a change is told', () => {
  let told = 0;
  const options = new Options();
  options.addEventListener('change', () => { told += 1; });
  options.fade('rods', 0.4);
  assert.deepEqual([told, options.opacity], [1, { rods: 0.4, layer: 0.75 }]);
});

test('what is seen through is written and read again, and never vanishes', () => {
  const options = new Options();
  options.fade('layer', 0.4);
  options.fade('rods', 0);
  assert.equal(options.words(), 'rods10,layer40');
  assert.deepEqual(new Options().read('rods10,layer40').opacity, options.opacity);
});
