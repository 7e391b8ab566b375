// @ts-check
/** What is known of each robot, for the strip and the map. Pure. */

/** The server's own limit wins, once it is known. */
export const SILENT_S = 8;

/** @typedef {'heard' | 'silent' | 'ended' | 'unknown'} Hearing */
/** @typedef {{name: string, pose: PoseRow, ageS: number | null, hearing: Hearing, driftM: number | null}} RobotView */

/**
 * @param {import('./inspection.js').Inspection} inspection
 * @param {number} nowMs epoch, the page's clock
 * @param {boolean} [linked] whether the server is heard: else nobody knows whom it hears
 * @returns {RobotView[]} by name, numbers in names counted as numbers
 */
export function robotViews(inspection, nowMs, linked = true) {
  const { state } = inspection.facts;
  return [...inspection.robots]
    .map(([name, { pose, heardAt }]) => {
      const ageS = Number.isFinite(heardAt) ? Math.max(0, (inspection.serverMs(nowMs) - heardAt) / 1000) : null;
      return { name, pose, ageS, hearing: hearingOf(linked ? ageS : null, state, inspection.alarms?.limits.robot_silent_s ?? SILENT_S), driftM: driftOf(pose) };
    })
    .sort((a, b) => a.name.localeCompare(b.name, 'en', { numeric: true }));
}

/** @param {string} state */
export function isRunning(state) {
  return !['finished', 'finishing', 'failed', 'closed'].includes(state);
}

/** @param {number | null} ageS @param {string} state @param {number} silentS @returns {Hearing} */
function hearingOf(ageS, state, silentS) {
  if (!isRunning(state)) return 'ended';
  if (ageS === null) return 'unknown';
  return ageS >= silentS ? 'silent' : 'heard';
}

/** How far the correction moved the pose that came in, m. @param {PoseRow} pose */
function driftOf(pose) {
  if (pose.raw_x_m == null || pose.raw_y_m == null || pose.x_m == null || pose.y_m == null) return null;
  return Math.hypot(pose.x_m - pose.raw_x_m, pose.y_m - pose.raw_y_m);
}
