// @ts-check
/** A pond's rods by state through its inspections, as bars of shares. Pure. */

/** From the bottom of a bar to its top. @type {{state: 'full' | 'partial' | 'empty' | 'not_observed', word: string}[]} */
export const STATES = [
  { state: 'full', word: 'Full' }, { state: 'partial', word: 'Partial' }, { state: 'empty', word: 'Empty' }, { state: 'not_observed', word: 'Not observed' },
];

/** Where each state's part of a bar of height 1 begins and ends, from the bottom. @param {Trend} one */
export function partsOf({ counts, rods }) {
  let from = 0;
  return STATES.map(({ state }) => {
    const size = rods ? counts[state] / rods : 0;
    from += size;
    return { state, from: from - size, size };
  });
}
