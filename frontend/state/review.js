// @ts-check
/**
 * One clock for all panels: live, or a moment of the past that can be held, moved and replayed. And the inspection as
 * far as that moment: what was seen by then, at today's corrected places; rods as they read then. Pure.
 */

import * as format from './format.js';
import { Inspection } from './inspection.js';
import { Looks } from './looks.js';
import { isRunning } from './robots.js';

export const SPEEDS = [1, 5, 20, 60];

export class Clock extends EventTarget {
  /** The moment shown, epoch ms, the server's clock; null: live. @type {number | null} */ atMs = null;
  playing = false;
  speed = 5;

  get live() { return this.atMs === null; }

  /** @param {number} atMs */
  seek(atMs) {
    this.atMs = atMs;
    this.dispatchEvent(new Event('change'));
  }

  goLive() {
    this.playing = false;
    this.atMs = null;
    this.dispatchEvent(new Event('change'));
  }

  /** Replay from a moment on. @param {number} fromMs the server's clock */
  replay(fromMs) {
    this.playing = true;
    this.seek(fromMs);
  }

  /** Hold, or go on; from live it holds the moment. @param {number} nowMs the server's clock */
  toggle(nowMs) {
    if (this.atMs === null) this.atMs = nowMs;
    else this.playing = !this.playing;
    this.dispatchEvent(new Event('change'));
  }

  /** Time passed; a replay that reaches the end of what there is holds there. @param {number} passedMs @param {number} lastMs */
  tick(passedMs, lastMs) {
    if (this.atMs === null || !this.playing) return;
    const next = this.atMs + passedMs * this.speed;
    if (next >= lastMs) this.playing = false;
    this.seek(Math.min(next, lastMs));
  }
}

/**
 * What the page shows and whether that is the newest, for the bar on top: a lost link comes before all else, then a
 * moment under review; *Final* is only the inspection as it ended.
 * @template {string} L
 * @param {L} link @param {number | null} atMs the moment under review; null: live @param {SessionFacts} facts
 * @returns {{state: L | 'review' | 'final', words: string | null}} words: null where the link's own will do
 */
export function standing(link, atMs, facts) {
  if (link !== 'live') return { state: link, words: null };
  if (atMs !== null) return { state: 'review', words: `Review ${format.hour(atMs)}` };
  if (isRunning(facts.state)) return { state: link, words: null };
  return { state: 'final', words: endOf(facts) ? 'Final' : 'Finishing…' };
}

/** How an inspection ended, in words; null while it goes on. @param {SessionFacts} facts */
export function endOf({ state, finished_at: at }) {
  if (!['finished', 'failed', 'closed'].includes(state)) return null;
  return `${state} ${at ? format.moment(at) : ''}`.trim();
}

/**
 * The inspection as far as a moment. A rod that nobody had looked at by then is not observed.
 * @param {Inspection} inspection @param {number} atMs epoch, the server's clock
 * @param {import('./readings.js').Readings | null} [readings] of its rods by then; absent: as they are known now
 */
export function asOf(inspection, atMs, readings = null) {
  const { facts } = inspection;
  const past = new Inspection({ ...facts, state: 'review' });
  past.heldAtMs = atMs;
  past.alarms = inspection.alarms;
  past.notes = inspection.notes;
  past.raster = inspection.raster;
  const poses = [...inspection.poses.values()].filter(({ received_at }) => Date.parse(received_at ?? '') <= atMs);
  past.apply({ type: 'poses', poses }, 0);
  const counts = { snapshots: poses.length, placed: 0, uncertain: 0, rejected: 0 };
  for (const { status } of poses) counts[status] += 1;
  past.facts.counts = counts;
  past.facts.coverage = null;
  if (facts.pond && facts.camera) showSeen(past, inspection, { pond: facts.pond, camera: facts.camera, poses, atMs, readings });
  past.revision = inspection.revision;
  return past;
}

/**
 * @param {Inspection} past @param {Inspection} inspection
 * @param {{pond: Pond, camera: Camera, poses: PoseRow[], atMs: number, readings: import('./readings.js').Readings | null}} then
 */
function showSeen(past, inspection, { pond, camera, poses, atMs, readings }) {
  const looks = new Looks(pond, camera);
  looks.count(poses, atMs);
  past.facts.coverage = looks.seenShare;
  for (const [id, { newestMs }] of looks.rods) {
    const row = newestMs && (readings ? readings.at(inspection.rod(id), atMs) : inspection.rod(id));
    if (row) past.rods.set(id, row);
  }
}
