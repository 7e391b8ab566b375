// @ts-check
/** How many snapshots come a second, and how long each took from the server's receipt to this page. Pure. */

const WINDOW_MS = 10_000;
const LATENCIES = 200;
const SAMPLE_MS = 5000;
export const SAMPLES = 60;

/** One point of a trend; null where there was nothing to tell. @typedef {{rate: number, latencyMs: number | null, queue: number | null}} Sample */

export class Pulse {
  /** @type {number[]} */ #arrivals = [];
  /** @type {number[]} */ #latencies = [];
  #nowMs = 0;
  #sampledMs = -Infinity;
  /** The last five minutes of this page, oldest first. @type {Sample[]} */ samples = [];

  /** New snapshots, by the server's clock. @param {number[]} receivedMs when the server took them @param {number} nowMs */
  arrived(receivedMs, nowMs) {
    this.#nowMs = nowMs;
    for (const atMs of receivedMs) {
      this.#arrivals.push(nowMs);
      if (Number.isFinite(atMs)) this.#latencies.push(Math.max(0, nowMs - atMs));
    }
    this.#latencies = this.#latencies.slice(-LATENCIES);
    this.tick(nowMs);
  }

  /** @param {number} nowMs */
  tick(nowMs) {
    this.#nowMs = nowMs;
    const first = this.#arrivals.findIndex((at) => at > nowMs - WINDOW_MS);
    this.#arrivals = first < 0 ? [] : this.#arrivals.slice(first);
  }

  /** Take a point of the trend, where it is time for one. @param {number} nowMs @param {number | null} queue not yet corrected */
  sample(nowMs, queue) {
    if (nowMs - this.#sampledMs < SAMPLE_MS) return;
    this.#sampledMs = nowMs;
    const latencyMs = this.#arrivals.length ? this.latencyMs : null;
    this.samples = [...this.samples, { rate: this.perSecond, latencyMs, queue }].slice(-SAMPLES);
  }

  get perSecond() { return this.#arrivals.length / (WINDOW_MS / 1000); }
  /** The median; null before the first. */
  get latencyMs() { return quantile(this.#latencies, 0.5); }
  /** What one in ten exceeds. */
  get worstMs() { return quantile(this.#latencies, 0.9); }
}

/** @param {number[]} values @param {number} share */
function quantile(values, share) {
  if (!values.length) return null;
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
}
