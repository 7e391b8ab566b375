import assert from 'node:assert/strict';
import { test } from 'node:test';
import { ReconcileOptions, counted, faultsOf, shown } from './reconciliation.js';

test('the view is in the address, and comes back from it', () => {
  const options = Object.assign(new ReconcileOptions(), { session: 's', inventory: 'i', line: 7, only: new Set(['disagree', 'ambiguous']) });
  assert.equal(options.address, '/?reconcile=s&inventory=i&only=disagree,ambiguous&line=7');
  assert.deepEqual({ ...new ReconcileOptions().read(options.address.slice(1)) }, { ...options });
  assert.deepEqual([new ReconcileOptions().read('?reconcile=s&line=x').line, new ReconcileOptions().read('?reconcile=s').inventory], [null, 'latest']);
});

test('discrepancies come first, each kind in the order of the file', () => {
  const line = (number, outcome) => ({ line: number, outcome });
  const lines = [line(2, 'agree'), line(3, 'disagree'), line(4, 'not_observed'), line(5, 'disagree'), line(6, 'ambiguous')];
  assert.deepEqual(shown(lines, new Set(['agree', 'disagree', 'not_observed', 'ambiguous'])).map((one) => one.line), [3, 5, 6, 4, 2]);
  assert.deepEqual(shown(lines, new Set(['agree'])).map((one) => one.line), [2]);
});

test('a refusal is told line by line, whatever a field of the file holds', () => {
  const detail = "line 3: item 'a; line 9: b' was given before, in line 2; line 5: date is missing. Nothing was imported.";
  assert.deepEqual(faultsOf(detail, '3, 5'), {
    faults: [{ line: 3, fault: "item 'a; line 9: b' was given before, in line 2" }, { line: 5, fault: 'date is missing' }], rest: 'Nothing was imported.',
  });
  assert.deepEqual(faultsOf('line 2: x; and 30 more. Nothing was imported.', '2, 3, 4'), { faults: [{ line: 2, fault: 'x' }], rest: '30 more. Nothing was imported.' });
  assert.deepEqual(faultsOf('The server does not answer.'), { faults: [], rest: 'The server does not answer.' });
});

test('counts are said in words', () => {
  assert.deepEqual([counted('disagree', 1), counted('disagree', 7), counted('not_observed', 2)], ['1 discrepancy', '7 discrepancies', '2 not observed']);
});
