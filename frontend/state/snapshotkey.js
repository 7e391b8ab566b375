// @ts-check
/** What names a snapshot, wherever the page keeps it by name. Pure. */

/** @param {{robot: string, boot?: number | null, sequence: number}} snapshot */
export function keyOf({ robot, boot, sequence }) { return `${robot}/${boot ?? 0}/${sequence}`; }
