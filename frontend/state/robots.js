// @ts-check
/** What is known of each robot, for the strip and the map. Pure. */

import { percent } from './format.js';

/** Whether the newest snapshot of an inspection that runs is so old that somebody should wonder. @param {SessionFacts} facts @param {number | null} ageMs */
export function isOld({ state }, ageMs) { return ageMs !== null && isRunning(state) && ageMs >= 1000 * SILENT_S; }

/** The server's own limit wins, once it is known. */
export const SILENT_S = 8;
const [LOW_BATTERY, HIGH_LOSS] = [0.2, 0.3];

/**
 * behind: what shows here is old, but the server holds snapshots that it has not corrected yet, and calls nobody silent.
 * @typedef {'heard' | 'silent' | 'behind' | 'ended' | 'unknown'} Hearing
 */
/** @typedef {{name: string, pose: PoseRow, ageS: number | null, hearing: Hearing, driftM: number | null}} RobotView */

/**
 * @param {import('./inspection.js').Inspection} inspection
 * @param {number} nowMs epoch, the page's clock
 * @param {boolean} [linked] whether the server is heard: else nobody knows whom it hears
 * @returns {RobotView[]} by name, numbers in names counted as numbers
 */
export function robotViews(inspection, nowMs, linked = true) {
  return [...inspection.robots]
    .map(([name, { pose, heardAt }]) => {
      const ageS = Number.isFinite(heardAt) ? Math.max(0, (inspection.serverMs(nowMs) - heardAt) / 1000) : null;
      return { name, pose, ageS, hearing: hearingOf(inspection, name, linked ? ageS : null), driftM: driftOf(pose) };
    })
    .sort((a, b) => a.name.localeCompare(b.name, 'en', { numeric: true }));
}

/** @param {string} state */
export function isRunning(state) {
  return !['finished', 'finishing', 'failed', 'closed'].includes(state);
}

/** @param {import('./inspection.js').Inspection} inspection @param {string} name @param {number | null} ageS @returns {Hearing} */
function hearingOf({ facts: { state, counts }, alarms, heldAtMs }, name, ageS) {
  if (!isRunning(state)) return 'ended';
  if (ageS === null) return 'unknown';
  if (ageS < (alarms?.limits.robot_silent_s ?? SILENT_S)) return 'heard';
  const queued = heldAtMs == null && (counts?.pending ?? 0) > 0;
  return queued && !alarms?.isActive('robot-silent', name) ? 'behind' : 'silent';
}

/** What a robot says of itself, in words; nothing where it says nothing. @param {PoseRow} pose @returns {string} */
export function saidOf({ battery, link_loss: loss, image_quality: quality }) {
  const words = /** @type {const} */ ([['battery', battery], ['loss', loss], ['image', quality]]);
  return words.flatMap(([word, share]) => (share == null ? [] : [`${word} ${percent(share)}`])).join(' · ');
}

/** Whether it should come in to be charged, or cannot be heard well. @param {PoseRow} pose */
export function isWeak({ battery = 1, link_loss: loss = 0 }) { return battery < LOW_BATTERY || loss > HIGH_LOSS; }

/** How far the correction moved the pose that came in, m. @param {PoseRow} pose */
function driftOf(pose) {
  if (pose.raw_x_m == null || pose.raw_y_m == null || pose.x_m == null || pose.y_m == null) return null;
  return Math.hypot(pose.x_m - pose.raw_x_m, pose.y_m - pose.raw_y_m);
}
