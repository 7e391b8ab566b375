// @ts-check
/** When each revision was drawn on the page: what the latency figures are made of. Keeps the newest ones only. */

const KEPT = 5000;

export class Painted {
  /** @type {Map<number, number>} */ #at = new Map();
  /** @type {number[]} */ #waiting = [];

  /** Everything of this revision is on the page but not drawn yet. @param {number} revision */
  wait(revision) { this.#waiting.push(revision); }

  /** The page was drawn. @param {number} atMs epoch */
  drawn(atMs) {
    for (const revision of this.#waiting) if (!this.#at.has(revision)) this.#at.set(revision, atMs);
    this.#waiting = [];
    while (this.#at.size > KEPT) this.#at.delete(/** @type {number} */ (this.#at.keys().next().value));
  }

  /**
   * When a revision was first on screen, epoch ms: itself, or the first later one that took it in; null where not yet.
   * @param {number} revision
   */
  at(revision) {
    let best = null;
    for (const [held, atMs] of this.#at) if (held >= revision && (best === null || atMs < best)) best = atMs;
    return best;
  }
}
