// @ts-check
/** The server's REST calls for ponds, their past, and two inspections beside each other. */

import { get } from './client.js';

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

