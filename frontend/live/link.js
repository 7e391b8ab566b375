// @ts-check
/**
 * The link to the live feed: connects, listens for the server's beat, reconnects with back-off from the last
 * revision held. Knows nothing of what the frames say.
 *
 * live          heard within SILENT_MS
 * connecting    first attempt, nothing heard yet
 * reconnecting  cut, and heard less than SILENT_MS ago
 * disconnected  nothing heard for SILENT_MS
 * refused       the server has no such session; no more attempts
 */

export const SILENT_MS = 2500;
const ATTEMPT_MS = 4000;
const BACKOFF_MS = [100, 300, 700, 1500, 3000];
const NO_SUCH_SESSION = 4404;

/** @typedef {'connecting' | 'live' | 'reconnecting' | 'disconnected' | 'refused'} LinkState */
/**
 * What a link needs of the world; tests hand in their own.
 * @typedef {{
 *   open: (since: number | null) => WebSocket,
 *   now: () => number,
 *   later: (run: () => void, ms: number) => unknown,
 *   random: () => number,
 * }} World
 */

export class Link extends EventTarget {
  /** @type {World} */ #world;
  /** @type {() => number | null} */ #revision;
  /** @type {WebSocket | null} */ #socket = null;
  /** @type {LinkState} */ #state = 'connecting';
  #heardAt = 0;
  #startedAt = 0;
  #attempts = 0;
  #stopped = false;
  /** Whether the socket that is open now was heard. */
  #heard = false;

  /**
   * @param {World} world
   * @param {() => number | null} revision the last one held in full
   */
  constructor(world, revision) {
    super();
    this.#world = world;
    this.#revision = revision;
  }

  get state() { return this.#state; }
  get attempts() { return this.#attempts; }
  /** Milliseconds since the server was last heard; since the start where it never was. */
  get silenceMs() { return this.#world.now() - (this.#heardAt || this.#startedAt); }

  start() {
    this.#startedAt = this.#world.now();
    this.#connect();
    this.#watch();
  }

  stop() {
    this.#stopped = true;
    this.#drop();
  }

  /** Connect anew after a pause: what arrived cannot be used, or there is word that the network is back. */
  restart(pauseMs = 0) {
    if (this.#stopped || this.#state === 'refused') return;
    this.#drop();
    this.#connectIn(pauseMs);
  }

  #connect() {
    const socket = this.#world.open(this.#revision());
    socket.binaryType = 'arraybuffer';
    this.#socket = socket;
    this.#heard = false;
    socket.onmessage = (event) => this.#hear(socket, event.data);
    socket.onclose = (event) => this.#lose(socket, event.code);
    this.#world.later(() => {
      if (this.#socket === socket && !this.#heard) this.#lose(socket, 0);
    }, ATTEMPT_MS);
  }

  /** @param {WebSocket} socket @param {string | ArrayBuffer} data */
  #hear(socket, data) {
    if (socket !== this.#socket) return;
    this.#heardAt = this.#world.now();
    this.#heard = true;
    this.#attempts = 0;
    this.#become('live');
    this.dispatchEvent(new CustomEvent('frame', { detail: data }));
  }

  /** @param {WebSocket} socket @param {number} code */
  #lose(socket, code) {
    if (socket !== this.#socket || this.#stopped) return;
    this.#drop();
    if (code === NO_SUCH_SESSION) return this.#become('refused');
    this.#judge();
    const pause = BACKOFF_MS[Math.min(this.#attempts, BACKOFF_MS.length - 1)] * (0.75 + this.#world.random() / 2);
    this.#attempts += 1;
    this.#connectIn(pause);
  }

  /** @param {number} pauseMs */
  #connectIn(pauseMs) {
    this.#world.later(() => {
      if (!this.#stopped && !this.#socket) this.#connect();
    }, pauseMs);
  }

  #drop() {
    const socket = this.#socket;
    this.#socket = null;
    if (!socket) return;
    socket.onmessage = socket.onclose = null;
    socket.close();
  }

  #watch() {
    if (this.#stopped || this.#state === 'refused') return;
    this.#judge();
    if (this.#state === 'disconnected' && this.#socket && this.#heard) {
      this.#lose(this.#socket, 0); // open, but dead: only a new one can tell
    }
    this.#world.later(() => this.#watch(), 250);
  }

  #judge() {
    if (this.silenceMs >= SILENT_MS) this.#become('disconnected');
    else if (!this.#socket && this.#heardAt) this.#become('reconnecting');
  }

  /** @param {LinkState} state */
  #become(state) {
    if (state === this.#state) return;
    this.#state = state;
    this.dispatchEvent(new Event('state'));
  }
}
