import assert from 'node:assert/strict';
import { test } from 'node:test';
import { parseFrame } from './protocol.js';

function patchFrame(header, content) {
  const json = new TextEncoder().encode(JSON.stringify(header));
  const frame = new Uint8Array(4 + json.length + content.length);
  new DataView(frame.buffer).setUint32(0, json.length);
  frame.set(json, 4);
  frame.set(content, 4 + json.length);
  return frame.buffer;
}

test('text is a message', () => {
  assert.deepEqual(parseFrame('{"type":"beat","revision":3}'), { type: 'beat', revision: 3 });
});

test('a binary frame is a patch with its bytes', () => {
  const patch = parseFrame(patchFrame({ type: 'patch', x: 1, y: 2 }, [9, 8, 7]));

  assert.equal(patch.x, 1);
  assert.deepEqual([...patch.content], [9, 8, 7]);
});

for (const [name, frame] of [['no type', '{}'], ['no object', 'null'], ['no JSON', '{'], ['cut', new ArrayBuffer(3)],
  ['a header that is cut', new Uint8Array([0, 0, 0, 9, 123, 125]).buffer]]) {
  test(`a frame with ${name} is refused`, () => assert.throws(() => parseFrame(frame)));
}
