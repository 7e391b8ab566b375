// @ts-check
/** Which moment the page shows: keeps the clock, its bar, and the inspection as far as that moment. */

import { Clock, asOf } from '../state/review.js';
import { TimeBar } from './timebar.js';

const LEAST_MS = 120;

export class Timekeeper extends EventTarget {
  clock = new Clock();
  #inspection;
  #shown;
  #tickedAt = performance.now();
  #madeAt = -Infinity;
  #stale = false;

  /** @param {import('../state/inspection.js').Inspection} inspection */
  constructor(inspection) {
    super();
    this.#inspection = this.#shown = inspection;
    this.bar = new TimeBar(this.clock, () => this.toggle());
    this.clock.addEventListener('change', () => this.#changed());
  }

  /** The inspection as the page should show it. */
  get shown() { return this.#shown; }
  get live() { return this.clock.live; }

  toggle() { this.clock.toggle(this.#inspection.serverMs(Date.now())); }

  /** Back or on by some seconds. @param {number} s */
  step(s) {
    const { span } = this.#inspection;
    if (!span) return;
    this.clock.seek(Math.min(span[1], Math.max(span[0], (this.clock.atMs ?? span[1]) + 1000 * s)));
  }

  tick() {
    const { span } = this.#inspection;
    const now = performance.now();
    this.clock.tick(now - this.#tickedAt, span?.[1] ?? 0);
    this.#tickedAt = now;
    if (this.#stale && now - this.#madeAt >= LEAST_MS) this.#make();
    this.bar.update(span);
  }

  #changed() {
    this.#stale = true;
    if (this.clock.live || performance.now() - this.#madeAt >= LEAST_MS) this.#make();
    this.bar.update(this.#inspection.span);
  }

  #make() {
    const { atMs } = this.clock;
    this.#shown = atMs === null ? this.#inspection : asOf(this.#inspection, atMs);
    this.#stale = false;
    this.#madeAt = performance.now();
    this.dispatchEvent(new Event('change'));
  }
}
