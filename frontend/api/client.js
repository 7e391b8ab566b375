// @ts-check
/** The server's REST calls that the page makes. Every failure is a `Problem` with a sentence for a person. */

const MOST_OTHERS = 12;

export class Problem extends Error {
  /** @param {string} message @param {number} status 0 where no answer came @param {{[name: string]: unknown}} [facts] */
  constructor(message, status, facts = {}) {
    super(message);
    this.status = status;
    this.facts = facts;
  }
}

/** @returns {Promise<SessionFacts[]>} newest first */
export async function listSessions() {
  const answer = await get('/api/sessions');
  return Array.isArray(answer) ? answer : (answer.sessions ?? answer.items ?? []);
}

/** Newest first, of those whose name holds `q`. @param {{q?: string, before?: string | null, limit?: number}} asked
 * @returns {Promise<{sessions: SessionFacts[], next: string | null}>} */
export function pageOfSessions({ q = '', before = null, limit = 25 }) {
  const query = new URLSearchParams({ limit: String(limit), ...(q ? { q } : {}), ...(before ? { before } : {}) });
  return get(`/api/sessions?${query}`);
}

/** @param {object} document the content of a session.json @returns {Promise<SessionFacts>} */
export function startSession(document) {
  return post('/api/sessions', document);
}

/** Let the simulator upload a demo inspection. */
export async function startDemo() {
  await post('/api/demo', {});
}

/** No more uploads. @param {string} id @returns {Promise<SessionFacts>} */
export function finishSession(id) {
  return post(`/api/sessions/${encodeURIComponent(id)}/finish?wait=0`, {});
}

/** @param {string} id @returns {Promise<SessionFacts>} */
export function getSession(id) {
  return get(`/api/sessions/${encodeURIComponent(id)}`);
}

/** @param {string} session @param {string} rod @returns {Promise<RodFacts>} */
export function getRod(session, rod) {
  return get(rodPath(session, rod));
}

/** Its readings in this inspection, what people said of it, and notes on it. @param {string} session @param {string} rod @returns {Promise<RodStory>} */
export function getRodRecord(session, rod) {
  return get(`${rodPath(session, rod)}/history`);
}

/**
 * The same rod in other inspections of a pond of the same size and number of rods, the newest first.
 * @param {SessionFacts} facts @param {string} rod @returns {Promise<{session: SessionFacts, reading: RodRow}[]>}
 */
export async function getOtherReadings(facts, rod) {
  const here = facts.pond;
  const alike = (await listSessions()).filter(({ id, pond, rods }) => id !== facts.id && pond?.width_m === here?.width_m
    && pond?.height_m === here?.height_m && rods === here?.rods?.length).slice(0, MOST_OTHERS);
  const found = await Promise.all(alike.map(async (session) => {
    const reading = await getRod(session.id, rod).catch((error) => { if (error.status === 404) return null; throw error; });
    return reading ? [{ session, reading }] : [];
  }));
  return found.flat();
}

/** What all rods read as, revision by revision. @param {string} session @returns {Promise<(PastReading & {rod_id: string})[]>} */
export async function getReadings(session) {
  return (await get(`/api/sessions/${encodeURIComponent(session)}/readings`)).readings;
}

/** Say what a rod is; `state` null takes that back. @param {string} session @param {string} rod
 * @param {{state: string | null, fill?: number, reason: string, by: string}} said @returns {Promise<Judgement>} */
export function judgeRod(session, rod, said) {
  return post(`${rodPath(session, rod)}/judgement`, said);
}

/** @param {string} session @param {{text: string, by: string, rod_id?: string, x_m?: number, y_m?: number, moment?: string}} said @returns {Promise<Note>} */
export function writeNote(session, said) {
  return post(`/api/sessions/${encodeURIComponent(session)}/notes`, said);
}

/** @param {string} session @param {number} note @param {string} by @returns {Promise<Note>} */
export function closeNote(session, note, by) {
  return post(`/api/sessions/${encodeURIComponent(session)}/notes/${note}/close`, { by });
}

/** What the next shift should know, of all inspections. @param {number} hours back
 * @returns {Promise<{notes: (Note & {session: string, session_name: string})[], judgements: (Judgement & {rod_id: string, session: string, session_name: string})[]}>} */
export function handover(hours) {
  return get(`/api/handover?hours=${hours}`);
}

/** As they stand, and the limits in force. @param {string} session @returns {Promise<{limits?: {[name: string]: number}}>} */
export function alarmsOf(session) {
  return get(`/api/sessions/${encodeURIComponent(session)}/alarms`);
}

/** What became of them, the newest first. @param {string} session @param {number | null} before
 * @returns {Promise<{events: {at: string, title: string, subject: string, act: string, by: string | null, text: string}[], next: number | null}>} */
export function alarmEvents(session, before) {
  return get(`/api/sessions/${encodeURIComponent(session)}/alarms/events${before === null ? '' : `?before=${before}`}`);
}

/** The same to some alarms, each answered for itself. @param {string} session @param {string} act @param {number[]} alarms
 * @param {{comment: string, by: string, for_s?: number}} said @returns {Promise<{status: number, detail?: string}[]>} */
export async function actOnAlarms(session, act, alarms, said) {
  return (await post(`/api/sessions/${encodeURIComponent(session)}/alarms/${act}`, { alarms, ...said })).results;
}

/** @typedef {{number: number, kind: 'foreign-object' | 'stain' | 'rod-displaced', x_m: number, y_m: number, size_mm: number, confidence: number,
 *   looks: number, agreeing: number, rod_id: string, offset_x_mm: number | null, offset_y_mm: number | null, sigma_mm: number | null}} Finding */

/** Of condition and position. @param {string} session @returns {Promise<{looked: boolean, examined: number, findings: Finding[]}>} */
export function findingsOf(session) {
  return get(`/api/sessions/${encodeURIComponent(session)}/findings`);
}

/** Its picture. @param {string} session @param {number} number */
export function findingUrl(session, number) {
  return `/api/sessions/${encodeURIComponent(session)}/findings/${number}/picture.png`;
}

/** What its rods are held against. @param {string} session @param {string | null} baseline an earlier session, or none @returns {Promise<object>} */
export function setBaseline(session, baseline) {
  return post(`/api/sessions/${encodeURIComponent(session)}/baseline`, { baseline }, 'PUT');
}

/** @param {string} session @param {string} rod */
function rodPath(session, rod) {
  return `/api/sessions/${encodeURIComponent(session)}/rods/${encodeURIComponent(rod)}`;
}

/** @param {string} session @param {{robot: string, boot: number, sequence: number}} key */
export function snapshotUrl(session, { robot, boot, sequence }) {
  const parts = [session, 'snapshots', robot, boot, sequence, 'image'].map((part) => encodeURIComponent(part));
  return `/api/sessions/${parts.join('/')}`;
}

/** Any answer shows that the server is there. @param {AbortSignal} signal @returns {Promise<unknown>} */
export function signOfLife(signal) {
  return fetch('/healthz', { signal, cache: 'no-store' });
}

/** @param {string} session @param {number | null} since */
export function openFeed(session, since) {
  const url = new URL(`/api/sessions/${encodeURIComponent(session)}/live`, location.href);
  url.protocol = url.protocol.replace('http', 'ws');
  if (since !== null) url.searchParams.set('since', String(since));
  return new WebSocket(url);
}

/** @param {string} path @param {number} [patienceMs] @returns {Promise<any>} */
export function get(path, patienceMs) {
  return ask(path, { headers: { accept: 'application/json' } }, patienceMs);
}

/** @param {string} path @param {object} body @param {string} [method] @returns {Promise<any>} */
export function post(path, body, method = 'POST') {
  const headers = { accept: 'application/json', 'content-type': 'application/json' };
  return ask(path, { method, headers, body: JSON.stringify(body) });
}

/** @param {string} path @param {RequestInit} init @param {number} [patienceMs] @returns {Promise<any>} */
export async function ask(path, init, patienceMs = 10_000) {
  let answer;
  try {
    answer = await fetch(path, { ...init, signal: AbortSignal.timeout(patienceMs) });
  } catch {
    throw new Problem('The server does not answer.', 0);
  }
  const body = await answer.json().catch(() => null);
  if (!answer.ok) throw new Problem(body?.detail ?? `The server answered ${answer.status}.`, answer.status, body ?? {});
  return body;
}
