// @ts-check
/** The snapshots behind a rod, as far as the moment that the page shows: a review holds nothing that came later. Pure. */

import { keyOf } from './snapshotkey.js';

/** @param {Evidence[]} snapshots as the server knows them now @param {import('./inspection.js').Inspection} shown as the page shows it */
export function behindThen(snapshots, { heldAtMs, poses }) {
  return heldAtMs == null ? snapshots : snapshots.filter((one) => poses.has(keyOf(one)));
}

/** A digest as far as one compares it by eye. @param {string} digest `sha256:` and 64 digits */
export function shortDigest(digest) { return `${digest.slice(0, 19)}…`; }

/** @param {number} count @param {boolean} isPast */
export function behindWords(count, isPast) {
  const by = isPast ? ' by then' : '';
  return count ? `Snapshots behind it${by} · ${count}` : isPast ? 'No snapshot had shown this rod by then.' : 'No snapshot shows this rod.';
}
