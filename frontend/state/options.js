// @ts-check
/** What the map is asked to show. One place for buttons, keys and the address. No DOM. */

export const PICTURES = /** @type {const} */ (['corrected', 'raw']);
export const LAYERS = /** @type {const} */ (['none', 'looks', 'age', 'uncertainty']);
export const MARKS = /** @type {const} */ (['rods', 'robots', 'tracks', 'grid']);

/** @typedef {typeof PICTURES[number]} Picture */
/** @typedef {typeof LAYERS[number]} Layer */
/** @typedef {typeof MARKS[number]} Mark */
/** What may be seen through. @typedef {'rods' | 'layer'} Sheet */

const OPACITY = /^(rods|layer)(\d+)$/; // `layer40`: per cent

export class Options extends EventTarget {
  /** @type {Picture} */ picture = 'corrected';
  /** @type {Layer} */ layer = 'none';
  /** @type {Record<Mark, boolean>} */ marks = { rods: true, robots: true, tracks: false, grid: false };
  /** Of the rods' symbols, and of the layer, 0 to 1. @type {Record<Sheet, number>} */ opacity = { rods: 1, layer: 0.75 };

  /** @param {Partial<Options>} change */
  set(change) {
    Object.assign(this, change);
    this.dispatchEvent(new Event('change'));
  }

  /** @param {Mark} mark */
  toggle(mark) { this.set({ marks: { ...this.marks, [mark]: !this.marks[mark] } }); }

  togglePicture() { this.set({ picture: this.picture === 'raw' ? 'corrected' : 'raw' }); }

  /** @param {Sheet} sheet @param {number} opacity 0 to 1 */
  fade(sheet, opacity) { this.set({ opacity: { ...this.opacity, [sheet]: Math.round(100 * Math.min(1, Math.max(0.1, opacity))) / 100 } }); }

  nextLayer() { this.set({ layer: LAYERS[(LAYERS.indexOf(this.layer) + 1) % LAYERS.length] }); }

  /** What differs from the start, as words: `raw,looks,-rods,layer40`. */
  words() {
    const marks = MARKS.filter((mark) => this.marks[mark] !== START.marks[mark]).map((mark) => (this.marks[mark] ? mark : `-${mark}`));
    const sheets = /** @type {Sheet[]} */ (['rods', 'layer']).filter((sheet) => this.opacity[sheet] !== START.opacity[sheet]);
    const faded = sheets.map((sheet) => `${sheet}${Math.round(100 * this.opacity[sheet])}`);
    return [...(this.picture === 'raw' ? ['raw'] : []), ...(this.layer === 'none' ? [] : [this.layer]), ...marks, ...faded].join(',');
  }

  /** Take what `words` gave; what is not known is passed over. @param {string | null} text */
  read(text) {
    for (const word of (text ?? '').split(',')) {
      const [, sheet, share] = OPACITY.exec(word) ?? [];
      const bare = /** @type {Mark} */ (word.replace(/^-/, ''));
      if (sheet) this.fade(/** @type {Sheet} */ (sheet), Number(share) / 100);
      else if (word === 'raw') this.picture = 'raw';
      else if (word !== 'none' && LAYERS.includes(/** @type {Layer} */ (word))) this.layer = /** @type {Layer} */ (word);
      else if (MARKS.includes(bare)) this.marks[bare] = bare === word;
    }
    return this;
  }
}

const START = Object.freeze(new Options());
