// @ts-check
/**
 * What an operator should look at now, the worst first, each with what to do. Conditions as they stand: nothing is
 * remembered here. Floods are told as one. Pure.
 */

import { verdictOf } from './rods.js';
import { isRunning } from './robots.js';

export const FLOOD = 3;
const STALE_SHARE = 0.5;
const POOR_SHARE = 0.1;
const BEHIND = 60;

/** @typedef {{kind: string, severity: number, text: string, advice: string, rod?: string, robot?: string, place?: {xM: number, yM: number}}} Note */

/**
 * @param {import('./inspection.js').Inspection} inspection
 * @param {import('./robots.js').RobotView[]} robots
 * @param {import('./looks.js').Looks | null} looks
 * @returns {Note[]}
 */
export function attentionOf(inspection, robots, looks) {
  const running = isRunning(inspection.facts.state);
  const notes = [...conflicting(inspection), ...failed(inspection), ...poor(inspection), ...behind(inspection),
    ...(running ? [...silent(robots), ...stale(looks)] : [])];
  return notes.sort((a, b) => b.severity - a.severity);
}

/** @param {import('./inspection.js').Inspection} inspection @returns {Note[]} */
function conflicting(inspection) {
  const ids = [...inspection.rods.values()].filter((rod) => verdictOf(rod) === 'conflicting').map((rod) => rod.rod_id).sort();
  const advice = 'Open the rod and judge its snapshots; send a robot for another look.';
  if (ids.length > FLOOD) return [{ kind: 'rod-conflicting', severity: 600, text: `${ids.length} rods: looks disagree`, advice, rod: ids[0] }];
  return ids.map((rod) => ({ kind: 'rod-conflicting', severity: 600, text: `Rod ${rod}: looks disagree`, advice, rod }));
}

/** @param {import('./robots.js').RobotView[]} robots @returns {Note[]} */
function silent(robots) {
  const quiet = robots.filter(({ hearing }) => hearing === 'silent');
  const advice = 'Look where it was last; check its radio link and battery, then the base station.';
  if (quiet.length > FLOOD) return [{ kind: 'robot-silent', severity: 550, text: `${quiet.length} of ${robots.length} robots are silent`, advice: 'Check the base station and its network first.' }];
  return quiet.map(({ name, ageS }) => ({ kind: 'robot-silent', severity: 500, text: `${name} silent for ${Math.round(ageS ?? 0)} s`, advice, robot: name }));
}

/** @param {import('./inspection.js').Inspection} inspection @returns {Note[]} */
function poor({ facts: { counts = {} } }) {
  const doubtful = (counts.uncertain ?? 0) + (counts.rejected ?? 0);
  if (!counts.snapshots || doubtful <= POOR_SHARE * counts.snapshots) return [];
  const text = `${doubtful} of ${counts.snapshots} snapshots are not surely placed`;
  return [{ kind: 'correction-poor', severity: 400, text, advice: "Do not rely on uncertain places; check the robots' localisation and the water." }];
}

/** @param {import('./inspection.js').Inspection} inspection @returns {Note[]} */
function behind({ facts: { counts = {} } }) {
  if ((counts.pending ?? 0) < BEHIND) return [];
  return [{ kind: 'behind', severity: 350, text: `The picture is ${counts.pending} snapshots behind`, advice: 'Wait, or let the robots send less often.' }];
}

/** @param {import('./inspection.js').Inspection} inspection @returns {Note[]} */
function failed({ facts: { state }, jobs }) {
  const stuck = [...jobs.values()].filter((job) => job.state === 'failed');
  if (state !== 'failed' && !stuck.length) return [];
  const text = `Correction failed${stuck[0]?.error ? `: ${stuck[0].error}` : ''}`;
  return [{ kind: 'failed', severity: 800, text, advice: "Tell whoever looks after the server; its log has the reason." }];
}

/** @param {import('./looks.js').Looks | null} looks @returns {Note[]} */
function stale(looks) {
  const share = looks?.twiceShare;
  if (share == null || share >= STALE_SHARE) return [];
  const text = `Only ${Math.floor(share * 100)} % of rods were seen twice in 30 min`;
  return [{ kind: 'coverage-stale', severity: 300, text, advice: 'Send a robot where the map says to look next.', ...(looks?.next ? { place: looks.next } : {}) }];
}
