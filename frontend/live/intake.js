// @ts-check
/**
 * Frames in, applied in the order in which they came, although patches decode at their own pace.
 *
 * A browser's socket takes whatever arrives, so a page too slow for the feed would pile up patches: over MOST_WAITING
 * it asks for a new connection, which gives the newest state in one step.
 */

import { parseFrame } from './protocol.js';

export const MOST_WAITING = 400;

/** @typedef {import('./protocol.js').Message} Message */
/**
 * @typedef {{
 *   decode: (patch: Patch) => Promise<CanvasImageSource>,
 *   paint: (patch: Patch, image: CanvasImageSource) => void,
 *   apply: (message: Message) => void,
 *   resync: (why: string) => void,
 * }} Uses
 */

export class Intake {
  /** @type {Uses} */ #uses;
  /** @type {Promise<void>} */ #last = Promise.resolve();
  #epoch = 0;
  #waiting = 0;
  dropped = 0;

  /** @param {Uses} uses */
  constructor(uses) {
    this.#uses = uses;
  }

  get waiting() { return this.#waiting; }

  /** @param {string | ArrayBuffer} data */
  push(data) {
    const epoch = this.#epoch;
    if (this.#waiting >= MOST_WAITING) return this.#giveUp('too many frames wait');
    this.#waiting += 1;
    const step = this.#prepare(data);
    step.catch(() => {});
    this.#last = this.#last
      .then(() => step)
      .then((run) => { if (epoch === this.#epoch) run(); })
      .catch((error) => { if (epoch === this.#epoch) this.#giveUp(String(error)); })
      .finally(() => { this.#waiting -= 1; });
  }

  /** What waits belongs to a connection that is gone: it will come again. */
  reset() {
    this.#epoch += 1;
  }

  /** @param {string | ArrayBuffer} data @returns {Promise<() => void>} */
  async #prepare(data) {
    const message = parseFrame(data);
    if (message.type !== 'patch') return () => this.#uses.apply(message);
    const patch = /** @type {Patch} */ (/** @type {unknown} */ (message));
    const image = await this.#uses.decode(patch);
    return () => this.#uses.paint(patch, image);
  }

  /** @param {string} why */
  #giveUp(why) {
    this.dropped += 1;
    this.reset();
    this.#uses.resync(why);
  }
}
