import assert from 'node:assert/strict';
import { test } from 'node:test';
import { format, parse } from './address.js';

const NONE = { session: null, rod: null, home: false, show: null, view: null, at: null };

test('what is written is read again', () => {
  const view = { xM: 0.1234, yM: 0.5, metresPerPx: 0.001 };
  for (const address of [{ ...NONE, session: 'a b&c', rod: 'R0012', show: 'raw,-rods' }, { ...NONE, home: true }, { ...NONE, session: 's' },
    { ...NONE, session: 's', view, at: Date.parse('2030-01-01T12:00:00.250Z') }]) {
    assert.deepEqual(parse(format(address).slice(1)), address);
  }
});

test('nothing to say is the root', () => assert.equal(format({}), '/'));

test('a view and a moment are legible in the address', () => {
  const address = format({ session: 's', view: { xM: 1, yM: 2, metresPerPx: 0.002 }, at: 0 });
  assert.equal(address, '/?session=s&view=1.0000,2.0000,0.002000&at=1970-01-01T00:00:00.000Z');
});

test('what is no view or no moment is passed over', () => {
  for (const view of ['', '1,2', '1,2,0', '1,x,3', '1,2,-1']) assert.equal(parse(`?session=s&view=${view}`).view, null);
  assert.equal(parse('?session=s&at=yesterday').at, null);
});
