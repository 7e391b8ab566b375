// @ts-check
/** What rods read as at a moment of the past, from the readings that the server kept revision by revision. Pure. */

/** @typedef {PastReading & {rod_id: string}} KeptReading */

export class Readings {
  /** @type {Map<string, {atMs: number, row: RodRow}[]>} */ #byRod = new Map();

  /** @param {KeptReading[]} kept in order of revision @param {number} untilMs up to when they are complete, epoch, the server's clock */
  constructor(kept, untilMs) {
    this.untilMs = untilMs;
    for (const { at, revision: _revision, ...row } of kept) {
      const rows = this.#byRod.get(row.rod_id);
      if (rows) rows.push({ atMs: Date.parse(at), row });
      else this.#byRod.set(row.rod_id, [{ atMs: Date.parse(at), row }]);
    }
  }

  /**
   * The rod as it read then, with what a person had said of it by then.
   * @param {RodRow} now as it is known now @param {number} atMs @returns {RodRow | null} null where nobody had read it yet
   */
  at(now, atMs) {
    const rows = this.#byRod.get(now.rod_id);
    const row = rows ? rows.findLast((one) => one.atMs <= atMs)?.row : now; // none kept at all: its reading never was otherwise
    if (!row) return null;
    return { ...row, by_hand: now.by_hand && Date.parse(now.by_hand.at) <= atMs ? now.by_hand : null };
  }
}
