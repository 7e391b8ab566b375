// @ts-check
/** What of the server's own work needs a look, the worst first, each with what to do; alarms are told apart. Pure. */

const BEHIND = 60;

/** @typedef {{kind: string, severity: number, text: string, advice: string}} Note */

/** @param {import('./inspection.js').Inspection} inspection @returns {Note[]} */
export function attentionOf(inspection) {
  return [...failed(inspection), ...behind(inspection)];
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
  return [{ kind: 'failed', severity: 800, text, advice: 'Tell whoever looks after the server; its log has the reason.' }];
}
