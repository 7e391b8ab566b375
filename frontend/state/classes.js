// @ts-check
/** The layers' classes: few, named, with a bound each; colours are named here and defined by the theme. Pure. */

/** @typedef {{most: number, word: string, colour: string}} Class `most`: the class's upper bound, inclusive */
/** @typedef {import('./options.js').Layer} Layer */

/** @type {Record<Exclude<Layer, 'none'>, {title: string, classes: Class[]}>} */
export const CLASSES = {
  looks: {
    title: 'Number of looks',
    classes: [
      { most: 1, word: 'once', colour: 'step-1' }, { most: 3, word: '2 to 3 times', colour: 'step-2' },
      { most: 7, word: '4 to 7 times', colour: 'step-3' }, { most: Infinity, word: '8 times or more', colour: 'step-4' },
    ],
  },
  age: {
    title: 'Age of the newest look',
    classes: [
      { most: 60, word: 'under 1 min', colour: 'step-4' }, { most: 600, word: 'under 10 min', colour: 'step-3' },
      { most: 1800, word: 'under 30 min', colour: 'step-2' }, { most: Infinity, word: 'older: stale', colour: 'step-bad' },
    ],
  },
  uncertainty: {
    title: 'Uncertainty of the place, one sigma',
    classes: [
      { most: 0.5, word: 'under half a pixel', colour: 'step-3' }, { most: 2, word: 'under 2 pixels', colour: 'step-2' },
      { most: 1e6, word: '2 pixels or more', colour: 'step-1' }, { most: Infinity, word: 'no sure look', colour: 'step-bad' },
    ],
  },
};

/** The class of a value: its index. @param {Class[]} classes @param {number} value */
export function classOf(classes, value) {
  return classes.findIndex(({ most }) => value <= most);
}

/**
 * The value that a layer shows of a cell.
 * @param {Exclude<Layer, 'none'>} layer @param {import('./looks.js').CellFacts} cell
 * @param {number} nowMs the server's clock @param {number} metresPerPixel of the raster
 */
export function valueOf(layer, cell, nowMs, metresPerPixel) {
  if (layer === 'looks') return cell.looks;
  if (layer === 'age') return Math.max(0, nowMs - cell.newestMs) / 1000;
  return cell.sigmaM / metresPerPixel;
}
