// @ts-check
/** What a rod reads as, in words, a letter and a share. Pure. */

/** @typedef {'empty' | 'partial' | 'full' | 'unseen' | 'conflicting'} Verdict */

/** In the order of a legend. @type {{verdict: Verdict, letter: string, word: string}[]} */
export const VERDICTS = [
  { verdict: 'full', letter: 'F', word: 'Full' },
  { verdict: 'partial', letter: 'P', word: 'Partial' },
  { verdict: 'empty', letter: 'E', word: 'Empty' },
  { verdict: 'conflicting', letter: 'C', word: 'Conflicting' },
  { verdict: 'unseen', letter: '?', word: 'Not observed' },
];

const BY_VERDICT = new Map(VERDICTS.map((entry) => [entry.verdict, entry]));

/** What holds of a rod: a person's word, where there is one, before the machine's. @param {RodRow} rod @returns {Verdict} */
export function verdictOf(rod) {
  return rod.by_hand?.state ?? machineVerdictOf(rod);
}

/** The share filled that goes with the verdict. @param {RodRow} rod */
export function fillOf(rod) {
  return rod.by_hand?.state ? rod.by_hand.fill : rod.fill;
}

/** What the machine reads. @param {RodRow} rod @returns {Verdict} */
export function machineVerdictOf(rod) {
  if (rod.views === 0 || rod.state === 'unseen') return 'unseen';
  return rod.conflicting ? 'conflicting' : rod.state;
}

/** @param {RodRow} rod what is written on the rod: a letter, with the share where it is partly filled */
export function labelOf(rod) {
  const verdict = verdictOf(rod);
  const letter = BY_VERDICT.get(verdict)?.letter ?? '?';
  const fill = fillOf(rod);
  return verdict === 'partial' && fill !== null ? `${letter}${Math.round(fill * 100)}` : letter;
}

/** @param {Verdict} verdict */
export function wordOf(verdict) {
  return BY_VERDICT.get(verdict)?.word ?? verdict;
}

/**
 * How many rods of each verdict; a rod of the layout never spoken of counts as not observed.
 * @param {Iterable<string>} ids the layout's
 * @param {(id: string) => RodRow} rod
 * @returns {Record<Verdict, number>}
 */
export function tally(ids, rod) {
  const counts = { full: 0, partial: 0, empty: 0, conflicting: 0, unseen: 0 };
  for (const id of ids) counts[verdictOf(rod(id))] += 1;
  return counts;
}

/**
 * The rod under a point of the pond, within its outer radius.
 * @param {RodLayout[]} rods @param {number} xM @param {number} yM @param {number} [reachM] at least this far
 * @returns {RodLayout | null}
 */
export function rodAt(rods, xM, yM, reachM = 0) {
  let best = null;
  let bestM = Infinity;
  for (const rod of rods) {
    const distanceM = Math.hypot(rod.x_m - xM, rod.y_m - yM);
    if (distanceM < bestM && distanceM <= Math.max(rod.outer_radius_m, reachM)) [best, bestM] = [rod, distanceM];
  }
  return best;
}
