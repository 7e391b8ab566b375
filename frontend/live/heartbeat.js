// @ts-check
/**
 * Whether the server is heard, for pages that have no live feed: asks for a sign of life every second, and says for how
 * long there was none. Any answer is one.
 */

import { SILENT_MS } from './link.js';

const EVERY_MS = 1000;
const PATIENCE_MS = 2000;

/** @typedef {{ask: (signal: AbortSignal) => Promise<unknown>, now: () => number, later: (run: () => void, ms: number) => unknown}} Uses */

export class Heartbeat extends EventTarget {
  #uses;
  #heardAt = 0;
  #stopped = false;
  #said = '';

  /** @param {Uses} uses */
  constructor(uses) {
    super();
    this.#uses = uses;
  }

  /** ms */
  get silenceMs() { return this.#uses.now() - this.#heardAt; }
  /** @returns {'live' | 'disconnected'} */
  get state() { return this.silenceMs >= SILENT_MS ? 'disconnected' : 'live'; }

  start() {
    this.#heardAt = this.#uses.now();
    void this.#ask();
    this.#watch();
  }

  stop() { this.#stopped = true; }

  async #ask() {
    if (this.#stopped) return;
    try {
      await this.#uses.ask(AbortSignal.timeout(PATIENCE_MS));
      this.#heardAt = this.#uses.now();
    } catch {
      // that nothing came is what is told
    }
    this.#uses.later(() => void this.#ask(), EVERY_MS);
  }

  /** Tell a change at once, and while there is silence how long it is. */
  #watch() {
    if (this.#stopped) return;
    const { state } = this;
    if (state !== this.#said || state === 'disconnected') this.dispatchEvent(new Event('state'));
    this.#said = state;
    this.#uses.later(() => this.#watch(), 250);
  }
}
