// @ts-check
/** The server's REST calls that the page makes. Every failure is a `Problem` with a sentence for a person. */

export class Problem extends Error {
  /** @param {string} message @param {number} status 0 where no answer came */
  constructor(message, status) {
    super(message);
    this.status = status;
  }
}

/** @returns {Promise<SessionFacts[]>} newest first */
export async function listSessions() {
  const answer = await get('/api/sessions');
  return Array.isArray(answer) ? answer : (answer.sessions ?? answer.items ?? []);
}

/** @param {string} id @returns {Promise<SessionFacts>} */
export function getSession(id) {
  return get(`/api/sessions/${encodeURIComponent(id)}`);
}

/** @param {string} session @param {string} rod @returns {Promise<RodFacts>} */
export function getRod(session, rod) {
  return get(`/api/sessions/${encodeURIComponent(session)}/rods/${encodeURIComponent(rod)}`);
}

/** @param {string} session @param {{robot: string, boot: number, sequence: number}} key */
export function snapshotUrl(session, { robot, boot, sequence }) {
  const parts = [session, 'snapshots', robot, boot, sequence, 'image'].map((part) => encodeURIComponent(part));
  return `/api/sessions/${parts.join('/')}`;
}

/** @param {string} session @param {number | null} since */
export function openFeed(session, since) {
  const url = new URL(`/api/sessions/${encodeURIComponent(session)}/live`, location.href);
  url.protocol = url.protocol.replace('http', 'ws');
  if (since !== null) url.searchParams.set('since', String(since));
  return new WebSocket(url);
}

/** @param {string} path @returns {Promise<any>} */
async function get(path) {
  let answer;
  try {
    answer = await fetch(path, { headers: { accept: 'application/json' }, signal: AbortSignal.timeout(10_000) });
  } catch {
    throw new Problem('The server does not answer.', 0);
  }
  const body = await answer.json().catch(() => null);
  if (!answer.ok) throw new Problem(body?.detail ?? `The server answered ${answer.status}.`, answer.status);
  return body;
}
