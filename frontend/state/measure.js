// @ts-check
/** A distance in the pond, from one point to another; a third point begins anew. Pure. */

/** @typedef {{xM: number, yM: number}} Place */

export class Measure {
  active = false;
  /** @type {Place[]} */ points = [];

  toggle() {
    this.active = !this.active;
    this.points = [];
  }

  /** @param {Place} place */
  add(place) {
    this.points = this.points.length < 2 ? [...this.points, place] : [place];
  }

  /** m; null before there are two points. */
  get distanceM() {
    const [from, to] = this.points;
    return to ? Math.hypot(to.xM - from.xM, to.yM - from.yM) : null;
  }
}
