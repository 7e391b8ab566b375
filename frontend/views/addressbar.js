// @ts-check
/** The view as the page's address, kept no oftener than browsers allow: a drag or a replay makes many. */

const LEAST_MS = 300;

export class AddressBar {
  #make;
  #keptAt = -Infinity;
  /** @type {number | undefined} */ #timer;

  /** @param {() => string} make the address as it should be now */
  constructor(make) {
    this.#make = make;
  }

  keep() {
    if (this.#keptAt + LEAST_MS > performance.now()) {
      this.#timer ??= setTimeout(() => { this.#timer = undefined; this.keep(); }, LEAST_MS);
      return;
    }
    this.#keptAt = performance.now();
    history.replaceState(null, '', this.#make());
  }
}
