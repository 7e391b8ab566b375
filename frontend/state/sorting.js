// @ts-check
/** Rows of a table in the order of one column: what a cell says for ordering, beside what it shows. Pure. */

/** A cell: what is shown, and by what it is ordered where that is not the text itself. @typedef {{show: string | Node, by?: number | string | null}} Cell */

/** @param {Cell[][]} rows @param {number} column @param {boolean} descending @returns {Cell[][]} those with nothing to order by last */
export function sorted(rows, column, descending) {
  const sign = descending ? -1 : 1;
  const keys = new Map(rows.map((row) => [row, keyOf(row[column])]));
  return rows.toSorted((a, b) => {
    const [x, y] = [keys.get(a) ?? null, keys.get(b) ?? null];
    if (x === null || y === null) return Number(x === null) - Number(y === null);
    return sign * (typeof x === 'number' && typeof y === 'number' ? x - y : String(x).localeCompare(String(y), 'en', { numeric: true }));
  });
}

/** @param {Cell} cell */
function keyOf({ show, by }) {
  return by === undefined ? (typeof show === 'string' ? show : show.textContent) : by;
}
