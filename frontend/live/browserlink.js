// @ts-check
/** What a link needs of the browser. */

import { openFeed } from '../api/client.js';

/** @param {string} session @returns {import('./link.js').World} */
export function world(session) {
  return { open: (since) => openFeed(session, since), now: Date.now, later: (run, ms) => setTimeout(run, ms), random: Math.random };
}
