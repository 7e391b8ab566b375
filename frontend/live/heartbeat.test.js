import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Heartbeat } from './heartbeat.js';

/** A world of its own time; `answers` says whether the server answers. */
function world() {
  const due = [];
  const made = { nowMs: 1000, answers: true, told: [] };
  made.uses = {
    ask: () => (made.answers ? Promise.resolve() : Promise.reject(new Error('no'))), now: () => made.nowMs,
    later: (run, ms) => due.push({ run, at: made.nowMs + ms }),
  };
  made.pass = async (ms) => {
    for (const end = made.nowMs + ms; made.nowMs < end; made.nowMs += 50) {
      for (const one of due.splice(0)) (one.at <= made.nowMs ? one.run() : due.push(one));
      await new Promise((done) => { setImmediate(done); });
    }
  };
  return made;
}

test('a server that answers is live', async () => {
  const { uses, pass } = world();
  const beat = new Heartbeat(uses);
  beat.start();
  await pass(20_000);
  assert.equal(beat.state, 'live');
});

test('one that does not is told within 3 s, and live again with the first answer', async () => {
  const made = world();
  const beat = new Heartbeat(made.uses);
  beat.start();
  await made.pass(5000);
  const states = [];
  beat.addEventListener('state', () => states.push(beat.state));
  made.answers = false;
  await made.pass(3000);
  assert.equal(states[0], 'disconnected');
  assert.ok(beat.silenceMs >= 2500);
  made.answers = true;
  await made.pass(1500);
  assert.equal(states.at(-1), 'live');
});
