// @ts-check
/** Which moment the page shows: keeps the clock, its bar, and the inspection as far as that moment. */

import { Problem, getReadings } from '../api/client.js';
import { Readings } from '../state/readings.js';
import { Clock, asOf, endOf } from '../state/review.js';
import { isRunning } from '../state/robots.js';
import { TimeBar } from './timebar.js';

const [LEAST_MS, ASK_AGAIN_MS] = [120, 2000];

export class Timekeeper extends EventTarget {
  clock = new Clock();
  #inspection;
  #shown;
  #tickedAt = performance.now();
  #madeAt = -Infinity;
  #stale = false;
  /** @type {Readings | null} */ #readings = null;
  #askedAt = -Infinity;

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

  /** Whether rods are shown as they read at the moment. */
  get hasReadings() { return this.#readings !== null; }
  /** @returns {'live' | 'final' | 'review'} */
  get mode() { return !this.live ? 'review' : endOf(this.#inspection.facts) ? 'final' : 'live'; }

  /** Hold or replay; what is finished is replayed from its beginning. */
  toggle() {
    const { span } = this.#inspection;
    if (this.mode === 'final' && span) this.clock.replay(span[0]);
    else this.clock.toggle(this.#inspection.serverMs(Date.now()));
  }

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
    this.#showBar();
  }

  #showBar() { this.bar.update(this.#inspection.span, endOf(this.#inspection.facts), isRunning(this.#inspection.facts.state)); }

  #changed() {
    this.#stale = true;
    if (this.clock.live || performance.now() - this.#madeAt >= LEAST_MS) this.#make();
    this.#showBar();
  }

  #make() {
    const { atMs } = this.clock;
    if (atMs !== null) void this.#read(atMs);
    this.#shown = atMs === null ? this.#inspection : asOf(this.#inspection, atMs, this.#readings);
    this.#stale = false;
    this.#madeAt = performance.now();
    this.dispatchEvent(new Event('change'));
  }

  /** Have what rods read as by the moment, once the server has said it. @param {number} atMs */
  async #read(atMs) {
    const now = performance.now();
    if ((this.#readings && atMs <= this.#readings.untilMs) || now - this.#askedAt < ASK_AGAIN_MS) return;
    this.#askedAt = now;
    const untilMs = this.#inspection.span?.[1] ?? atMs;
    try {
      this.#readings = new Readings(await getReadings(this.#inspection.facts.id), untilMs);
    } catch (error) {
      if (!(error instanceof Problem)) throw error; // the legend goes on saying that readings are those of now
    }
    if (!this.live) this.#make();
  }
}
