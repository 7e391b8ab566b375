// @ts-check
/** In the first minute, and while it is being finished, an inspection's uncertain poses are still being decided; the page says so before anybody worries. Later an uncertain pose is what it is called. Pure. */

import { isRunning } from './robots.js';

const MANY = 0.05;
const EARLY_MS = 60_000;

/** @param {import('./inspection.js').Inspection} inspection */
function doubtfulOf({ facts: { counts = {} } }) {
  const corrected = (counts.snapshots ?? 0) - (counts.pending ?? 0);
  return { uncertain: counts.uncertain ?? 0, corrected };
}

/** Whether many poses are uncertain. @param {import('./inspection.js').Inspection} inspection */
export function manyUncertain(inspection) {
  const { uncertain, corrected } = doubtfulOf(inspection);
  return uncertain > MANY * corrected;
}

/** In words, while that is so and has had no time to be otherwise; else null.
 * @param {import('./inspection.js').Inspection} inspection @param {number} nowMs the server's clock */
export function decidingWords(inspection, nowMs) {
  const { uncertain, corrected } = doubtfulOf(inspection);
  const { facts: { state }, heldAtMs } = inspection;
  if (heldAtMs != null || !manyUncertain(inspection) || (!isEarly(inspection, nowMs) && state !== 'finishing')) return null;
  const settles = isRunning(state) ? 'more snapshots of the same places settle most of them' : 'the last correction is under way';
  return `Poses are still being decided: ${uncertain} of ${corrected} are uncertain so far; ${settles}.`;
}

/** Whether that is as it should be: the first snapshots have had no time to be settled.
 * @param {import('./inspection.js').Inspection} inspection @param {number} nowMs the server's clock */
export function isEarly({ facts: { state }, span }, nowMs) {
  return isRunning(state) && (!span || nowMs - span[0] < EARLY_MS);
}
