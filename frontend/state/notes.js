// @ts-check
/** Notes: which first, what each is about, and what is sent to write one. Pure. */

import { spot } from './format.js';

/** Those that nobody dealt with first, then the newest. @param {Iterable<Note>} notes @returns {Note[]} */
export function openFirst(notes) {
  return [...notes].sort((a, b) => Number(Boolean(a.closed_at)) - Number(Boolean(b.closed_at)) || b.at.localeCompare(a.at) || b.id - a.id);
}

/** What a note is about, in words; nothing where it is about all. @param {Note} note @param {(at: string) => string} clock */
export function aboutOf({ rod_id: rod, x_m, y_m, moment }, clock) {
  if (rod) return `Rod ${rod}`;
  if (x_m !== null && y_m !== null) return spot(x_m, y_m);
  return moment ? `At ${clock(moment)}` : '';
}

/**
 * The body of a note. A moment that is asked for while the page is live is that of writing, which is kept anyway.
 * @param {string} text @param {string} about `all`, `place` or `moment`
 * @param {{middle: {xM: number, yM: number} | null, moment: number | null}} shown moment: epoch ms; null: live
 * @returns {{text: string, x_m?: number, y_m?: number, moment?: string}}
 */
export function noteOf(text, about, { middle, moment }) {
  const said = { text: text.trim() };
  if (about === 'place' && middle) return { ...said, x_m: middle.xM, y_m: middle.yM };
  return about === 'moment' && moment !== null ? { ...said, moment: new Date(moment).toISOString() } : said;
}
