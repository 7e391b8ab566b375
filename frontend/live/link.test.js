import assert from 'node:assert/strict';
import { beforeEach, test } from 'node:test';
import { Link } from './link.js';

/** A world whose time passes by hand. */
class World {
  time = 1000;
  sockets = [];
  timers = [];
  now = () => this.time;
  random = () => 0.5;
  later = (run, ms) => this.timers.push({ run, at: this.time + ms });
  open = (since) => {
    const socket = { since, closed: false, close() { this.closed = true; } };
    this.sockets.push(socket);
    return socket;
  };
  get socket() { return this.sockets.at(-1); }
  pass(ms) {
    for (const end = this.time + ms; ;) {
      const due = this.timers.filter(({ at }) => at <= end).sort((a, b) => a.at - b.at)[0];
      if (!due) { this.time = end; return; }
      this.timers.splice(this.timers.indexOf(due), 1);
      this.time = Math.max(this.time, due.at);
      due.run();
    }
  }
  beatFor(ms) {
    for (let passed = 0; passed < ms; passed += 1000) {
      this.socket.onmessage({ data: 'beat' });
      this.pass(1000);
    }
  }
}

let world, link, revision;
beforeEach(() => {
  world = new World();
  revision = null;
  link = new Link(world, () => revision);
  link.start();
});

test('it is live once something was heard, and stays so while the server beats', () => {
  assert.equal(link.state, 'connecting');
  world.beatFor(60_000);
  assert.equal(link.state, 'live');
  assert.equal(world.sockets.length, 1);
});

test('a server that was never heard is disconnected within 3 s', () => {
  world.pass(3000);
  assert.equal(link.state, 'disconnected');
});

test('an open link that falls silent is disconnected within 3 s, and replaced', () => {
  world.beatFor(5000);
  world.pass(2000);
  assert.equal(link.state, 'disconnected');
  world.pass(1000);
  assert.ok(world.sockets.length > 1);
  assert.ok(world.sockets[0].closed);
});

test('a cut link goes on from the revision that is held', () => {
  world.beatFor(1000);
  revision = 41;
  world.socket.onclose({ code: 1006 });
  assert.equal(link.state, 'reconnecting');
  world.pass(500);
  assert.equal(world.socket.since, 41);
  world.socket.onmessage({ data: 'hello' });
  assert.equal(link.state, 'live');
});

test('attempts come at growing distances, at most 4 s apart', () => {
  const at = [];
  for (let i = 0; i < 9; i += 1) {
    at.push(world.time);
    const before = world.sockets.length;
    world.socket.onclose({ code: 1006 });
    while (world.sockets.length === before) world.pass(50);
  }
  const gaps = at.slice(1).map((time, i) => time - at[i]);
  assert.ok(gaps[0] < 250 && gaps[3] > gaps[0]);
  assert.ok(Math.max(...gaps) < 4000);
});

test('a connection that does not open is given up for another', () => {
  world.pass(10_000);
  assert.ok(world.sockets.length >= 2);
});

test('a session that the server does not know is not asked for again', () => {
  world.socket.onclose({ code: 4404 });
  world.pass(60_000);
  assert.equal(link.state, 'refused');
  assert.equal(world.sockets.length, 1);
});

test('what an old socket still says is not heard', () => {
  const frames = [];
  link.addEventListener('frame', (event) => frames.push(event.detail));
  const old = world.socket;
  const hear = old.onmessage;
  old.onclose({ code: 1006 });
  world.pass(1000);
  hear({ data: 'late' });
  assert.deepEqual(frames, []);
});

test('stopped, it opens nothing more', () => {
  link.stop();
  world.pass(60_000);
  assert.equal(world.sockets.length, 1);
});
