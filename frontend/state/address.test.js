import assert from 'node:assert/strict';
import { test } from 'node:test';
import { format, parse } from './address.js';

test('what is written is read again', () => {
  for (const address of [{ session: 'a b&c', rod: 'R0012', home: false, show: 'raw,-rods' }, { session: null, rod: null, home: true, show: null },
    { session: 's', rod: null, home: false, show: null }]) {
    assert.deepEqual(parse(format(address).slice(1)), address);
  }
});

test('nothing to say is the root', () => assert.equal(format({}), '/'));
