// @ts-check
/** What the map is asked to show. One place for buttons, keys and the address. No DOM. */

export const PICTURES = /** @type {const} */ (['corrected', 'raw']);
export const LAYERS = /** @type {const} */ (['none', 'looks', 'age', 'uncertainty']);
export const MARKS = /** @type {const} */ (['rods', 'robots', 'tracks', 'grid']);

/** @typedef {typeof PICTURES[number]} Picture */
/** @typedef {typeof LAYERS[number]} Layer */
/** @typedef {typeof MARKS[number]} Mark */

export class Options extends EventTarget {
  /** @type {Picture} */ picture = 'corrected';
  /** @type {Layer} */ layer = 'none';
  /** @type {Record<Mark, boolean>} */ marks = { rods: true, robots: true, tracks: false, grid: false };
  /** Of the rods' symbols, 0 to 1. */
  opacity = 1;

  /** @param {Partial<Options>} change */
  set(change) {
    Object.assign(this, change);
    this.dispatchEvent(new Event('change'));
  }

  /** @param {Mark} mark */
  toggle(mark) { this.set({ marks: { ...this.marks, [mark]: !this.marks[mark] } }); }

  togglePicture() { this.set({ picture: this.picture === 'raw' ? 'corrected' : 'raw' }); }

  nextLayer() { this.set({ layer: LAYERS[(LAYERS.indexOf(this.layer) + 1) % LAYERS.length] }); }

  /** What differs from the start, as words: `raw,looks,-rods`. */
  words() {
    const marks = MARKS.filter((mark) => this.marks[mark] !== START.marks[mark]).map((mark) => (this.marks[mark] ? mark : `-${mark}`));
    return [...(this.picture === 'raw' ? ['raw'] : []), ...(this.layer === 'none' ? [] : [this.layer]), ...marks].join(',');
  }

  /** Take what `words` gave; what is not known is passed over. @param {string | null} text */
  read(text) {
    for (const word of (text ?? '').split(',')) {
      const bare = /** @type {Mark} */ (word.replace(/^-/, ''));
      if (word === 'raw') this.picture = 'raw';
      else if (word !== 'none' && LAYERS.includes(/** @type {Layer} */ (word))) this.layer = /** @type {Layer} */ (word);
      else if (MARKS.includes(bare)) this.marks[bare] = bare === word;
    }
    return this;
  }
}

const START = Object.freeze(new Options());
