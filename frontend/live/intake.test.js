import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Intake, MOST_WAITING } from './intake.js';

function patch(x) {
  const json = new TextEncoder().encode(JSON.stringify({ type: 'patch', x }));
  const frame = new Uint8Array(4 + json.length);
  new DataView(frame.buffer).setUint32(0, json.length);
  frame.set(json, 4);
  return frame.buffer;
}

function desk(decode = async ({ x }) => `image ${x}`) {
  const done = [];
  const intake = new Intake({
    decode,
    paint: ({ x }, image) => done.push([x, image]),
    apply: (message) => done.push(message.type),
    resync: (why) => done.push(['resync', why]),
  });
  return { intake, done };
}

const settled = () => new Promise((resolve) => setTimeout(resolve, 30));

test('frames are applied in the order in which they came, however long a patch takes to decode', async () => {
  const waits = { 1: 20, 2: 1 };
  const { intake, done } = desk(({ x }) => new Promise((resolve) => setTimeout(() => resolve(`image ${x}`), waits[x])));
  intake.push(patch(1));
  intake.push(patch(2));
  intake.push('{"type":"session"}');
  await settled();

  assert.deepEqual(done, [[1, 'image 1'], [2, 'image 2'], 'session']);
  assert.equal(intake.waiting, 0);
});

test('a patch that cannot be decoded asks for a new start, and nothing after it is applied', async () => {
  const { intake, done } = desk(async ({ x }) => { if (x === 1) throw new Error('not an image'); return ''; });
  intake.push(patch(1));
  intake.push('{"type":"session"}');
  await settled();

  assert.deepEqual(done, [['resync', 'Error: not an image']]);
});

test('a page too slow for the feed asks for the newest state instead of piling up frames', async () => {
  const { intake, done } = desk(() => new Promise(() => {}));
  for (let i = 0; i <= MOST_WAITING; i += 1) intake.push(patch(i));
  await settled();

  assert.deepEqual(done, [['resync', 'too many frames wait']]);
});
