// @ts-check
/** Where names stand beside what they name, so that none covers another. Pure. */

/** @typedef {{x: number, y: number, width: number}} Named what is named, and how wide its name is */
/** @typedef {{x: number, y: number}} Spot the middle of a name's left edge */

const SIDES = /** @type {const} */ ([[1, -1], [-1, -1], [1, 1], [-1, 1]]); // right and above first

/** For each, the first of four spots that lies within the picture and touches no name before it; else the first within.
 * @param {Named[]} things @param {{height: number, aside: number, above: number, across: number}} size
 * height: of a name. aside, above: from what is named to its name. across: the picture's width.
 * @returns {Spot[]} */
export function spots(things, { height, aside, above, across }) {
  /** @type {{x: number, y: number, width: number}[]} */
  const taken = [];
  return things.map(({ x, y, width }) => {
    const all = SIDES.map(([right, below]) => ({ x: right > 0 ? x + aside : x - aside - width, y: y + below * above, width }));
    const within = all.filter((spot) => spot.x >= 0 && spot.x + width <= across);
    const free = within.find((spot) => taken.every((other) => !touch(spot, other, height)));
    const chosen = free ?? within[0] ?? all[0];
    taken.push(chosen);
    return { x: chosen.x, y: chosen.y };
  });
}

/** @param {{x: number, y: number, width: number}} a @param {{x: number, y: number, width: number}} b @param {number} height */
function touch(a, b, height) {
  return a.x < b.x + b.width && b.x < a.x + a.width && Math.abs(a.y - b.y) < height;
}
