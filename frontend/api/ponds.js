// @ts-check
/** The server's REST calls for ponds, their past, and two inspections beside each other. */

import { ask, get, post } from './client.js';

const COMPARE_MS = 60_000; // the first comparison of a large mosaic measures it

/** @param {string} base a session, or `last` @param {string} later @returns {Promise<CompareAnswer>} */
export function compareSessions(base, later) {
  return get(compareUrl(base, later), COMPARE_MS);
}

/** @param {string} base @param {string} later @param {Record<string, string>} [more] */
export function compareUrl(base, later, more = {}) {
  return `/api/compare?${new URLSearchParams({ base, with: later, ...more })}`;
}

/** @param {string} session @param {string} rod */
export function rodPictureUrl(session, rod) {
  return `${sessionPath(session)}/rods/${encodeURIComponent(rod)}/picture.png`;
}

/** @param {string} session @param {number} revision @param {{z: number, x: number, y: number}} tile */
export function tileUrl(session, revision, { z, x, y }) {
  return `${sessionPath(session)}/tiles/mosaic/${z}/${x}/${y}?revision=${revision}`;
}

/** @param {string} session @returns {Promise<RodRow[]>} */
export async function getRods(session) {
  return (await get(`${sessionPath(session)}/rods`)).rods;
}

/** @returns {Promise<PondSummary[]>} newest first */
export async function listPonds() {
  return (await get('/api/ponds')).ponds;
}

/** @param {string} pond @returns {Promise<PondFacts>} */
export function getPond(pond) {
  return get(pondPath(pond));
}

/** One rod in every inspection of its pond, the oldest first. @param {string} pond @param {string} rod @returns {Promise<PastInspection[]>} */
export async function getRodHistory(pond, rod) {
  return (await get(`${pondPath(pond)}/rods/${encodeURIComponent(rod)}/history`)).history;
}

/** Rods by state in every inspection, the oldest first. @param {string} pond @returns {Promise<Trend[]>} */
export async function getTrends(pond) {
  return (await get(`${pondPath(pond)}/trends`)).inspections;
}

/** @param {string} session */
export function sessionPath(session) {
  return `/api/sessions/${encodeURIComponent(session)}`;
}

/** @param {string} pond */
export function pondPath(pond) {
  return `/api/ponds/${encodeURIComponent(pond)}`;
}


/** @param {string} session @param {string} inventory an id, or `latest` @returns {Promise<Reconciliation>} */
export function reconcile(session, inventory) {
  return get(reconcileUrl(session, inventory));
}

/** @param {string} session @param {string} inventory @param {Record<string, string>} [more] */
export function reconcileUrl(session, inventory, more = {}) {
  return `${sessionPath(session)}/reconcile?${new URLSearchParams({ inventory, ...more })}`;
}

/** Checked whole; one faulty line refuses all of it. @param {string} pond @param {File} file @returns {Promise<Inventory>} */
export function importInventory(pond, file) {
  return sendFile(`${pondPath(pond)}/inventories?${new URLSearchParams({ name: file.name })}`, file, 'text/csv');
}

/** A layout for a new pond (`path` is /api/ponds), or a further version of one. @param {string} path @param {File} file
 * @param {Record<string, string>} query @returns {Promise<PondFacts>} */
export function importLayout(path, file, query) {
  const isCsv = file.name.toLowerCase().endsWith('.csv');
  return sendFile(`${path}?${new URLSearchParams(query)}`, file, isCsv ? 'text/csv' : 'application/json');
}

/** The same of an inspection's layout. @param {string} path @param {Record<string, string>} query with `session` @returns {Promise<PondFacts>} */
export function takeLayout(path, query) {
  return ask(`${path}?${new URLSearchParams(query)}`, { method: 'POST', headers: { accept: 'application/json' } });
}

/** @param {string} pond @param {string} name @returns {Promise<PondFacts>} */
export function renamePond(pond, name) {
  return post(pondPath(pond), { name }, 'PATCH');
}

/** The methods that the server has for the session, and its own. @param {string} session @returns {Promise<{own: string, methods: string[]}>} */
export function methodsOf(session) {
  return get(`${sessionPath(session)}/corrections`);
}

/** Once more, by another method. @param {string} session @param {string} method @returns {Promise<MethodResult>} */
export function correctAgain(session, method) {
  return post(`${sessionPath(session)}/corrections`, { method });
}

/** @param {string} session @param {string} method @returns {Promise<Verdicts>} */
export function compareMethods(session, method) {
  return get(`${sessionPath(session)}/corrections/verdicts?${new URLSearchParams({ with: method })}`);
}

/** @param {string} path @param {File} file @param {string} type @returns {Promise<any>} */
function sendFile(path, file, type) {
  return ask(path, { method: 'POST', headers: { accept: 'application/json', 'content-type': type }, body: file }, 60_000);
}
