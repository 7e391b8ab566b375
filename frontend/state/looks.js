// @ts-check
/**
 * How often, how lately and how surely each place of the pond was seen, from the corrected poses. Pure.
 *
 * The floor is cut into square cells; a snapshot looks at a cell whose centre lies in its footprint. Rods are counted
 * by their centres, each for itself.
 */

export const RECENT_MS = 30 * 60_000;
const CELLS_A_FOOTPRINT = 14;
const MOST_COLUMNS = 420;

/** @typedef {{looks: number, newestMs: number, sigmaM: number}} CellFacts sigmaM: of the surest look; Infinity: none is sure */

export class Looks {
  /** @type {Map<string, {recent: number, newestMs: number}>} */ rods = new Map();

  /** Share of the rods seen at least twice within RECENT_MS; null without a layout. @type {number | null} */ twiceShare = null;
  /** Where one snapshot would help most: with most rods not seen twice lately. @type {{xM: number, yM: number, rods: number} | null} */ next = null;

  /** @param {Pond} pond @param {Camera} camera */
  constructor(pond, camera) {
    this.pond = pond;
    this.half = [(camera.width_px * camera.metres_per_pixel) / 2, (camera.height_px * camera.metres_per_pixel) / 2];
    this.cellM = Math.max((2 * Math.min(...this.half)) / CELLS_A_FOOTPRINT, pond.width_m / MOST_COLUMNS, pond.height_m / MOST_COLUMNS);
    this.columns = Math.max(1, Math.ceil(pond.width_m / this.cellM));
    this.rows = Math.max(1, Math.ceil(pond.height_m / this.cellM));
    this.looks = new Uint16Array(this.columns * this.rows);
    this.newestMs = new Float64Array(this.columns * this.rows);
    this.sigmaM = new Float32Array(this.columns * this.rows);
  }

  /** Count anew. @param {Iterable<PoseRow>} poses @param {number} nowMs epoch, the server's clock */
  count(poses, nowMs) {
    this.looks.fill(0);
    this.newestMs.fill(0);
    this.sigmaM.fill(Infinity);
    this.rods = new Map((this.pond.rods ?? []).map((rod) => [rod.id, { recent: 0, newestMs: 0 }]));
    for (const pose of poses) {
      if (pose.x_m === null || pose.y_m === null || pose.theta_rad === null) continue;
      const atMs = Date.parse(pose.captured_at ?? pose.received_at ?? '') || 0;
      const heardMs = Date.parse(pose.received_at ?? '') || atMs;
      const sigmaM = pose.status === 'placed' ? (pose.sigma_xy_m ?? Infinity) : Infinity;
      const at = { x_m: pose.x_m, y_m: pose.y_m, theta_rad: pose.theta_rad };
      this.#countCells(at, heardMs, sigmaM);
      this.#countRods(at, heardMs, nowMs - heardMs <= RECENT_MS);
    }
    this.#summarise();
  }

  /** @param {number} xM @param {number} yM @returns {CellFacts | null} null outside the pond */
  at(xM, yM) {
    const [column, row] = [Math.floor(xM / this.cellM), Math.floor((this.pond.height_m - yM) / this.cellM)];
    if (column < 0 || row < 0 || column >= this.columns || row >= this.rows) return null;
    const i = row * this.columns + column;
    return { looks: this.looks[i], newestMs: this.newestMs[i], sigmaM: this.sigmaM[i] };
  }

  /** Share of the floor seen at all. */
  get seenShare() {
    return this.looks.reduce((seen, looks) => seen + (looks ? 1 : 0), 0) / this.looks.length;
  }

  #summarise() {
    const rods = this.pond.rods ?? [];
    const needy = rods.filter((rod) => (this.rods.get(rod.id)?.recent ?? 0) < 2);
    this.twiceShare = rods.length ? 1 - needy.length / rods.length : null;
    this.next = this.#bestOf(needy);
  }

  /**
   * The place of a rod whose footprint holds most of them, counted by cells through a table of sums.
   * @param {RodLayout[]} needy @returns {{xM: number, yM: number, rods: number} | null}
   */
  #bestOf(needy) {
    const width = this.columns + 1;
    const sums = new Uint32Array(width * (this.rows + 1));
    for (const { x_m, y_m } of needy) sums[(this.#row(y_m) + 1) * width + this.#column(x_m) + 1] += 1;
    for (let row = 1; row <= this.rows; row += 1) {
      for (let i = row * width + 1, inRow = 0; i < (row + 1) * width; i += 1) {
        inRow += sums[i];
        sums[i] = inRow + sums[i - width];
      }
    }
    let best = null;
    for (const { x_m, y_m } of needy) {
      const [left, right] = [this.#column(x_m - this.half[0]), this.#column(x_m + this.half[0]) + 1];
      const [top, bottom] = [this.#row(y_m + this.half[1]) * width, (this.#row(y_m - this.half[1]) + 1) * width];
      const rods = sums[bottom + right] - sums[bottom + left] - sums[top + right] + sums[top + left];
      if (!best || rods > best.rods) best = { xM: x_m, yM: y_m, rods };
    }
    return best;
  }

  /** @param {PlanePose} pose @param {number} atMs @param {number} sigmaM */
  #countCells(pose, atMs, sigmaM) {
    const reach = Math.hypot(...this.half);
    const [left, right] = [this.#column(pose.x_m - reach), this.#column(pose.x_m + reach)];
    const [top, bottom] = [this.#row(pose.y_m + reach), this.#row(pose.y_m - reach)];
    const inside = this.#insideOf(pose);
    for (let row = top; row <= bottom; row += 1) {
      const yM = this.pond.height_m - (row + 0.5) * this.cellM;
      for (let column = left; column <= right; column += 1) {
        if (!inside((column + 0.5) * this.cellM, yM)) continue;
        const i = row * this.columns + column;
        this.looks[i] += 1;
        if (atMs > this.newestMs[i]) this.newestMs[i] = atMs;
        if (sigmaM < this.sigmaM[i]) this.sigmaM[i] = sigmaM;
      }
    }
  }

  /** @param {PlanePose} pose @param {number} atMs @param {boolean} recent */
  #countRods(pose, atMs, recent) {
    const inside = this.#insideOf(pose);
    for (const rod of this.pond.rods ?? []) {
      if (!inside(rod.x_m, rod.y_m)) continue;
      const facts = /** @type {{recent: number, newestMs: number}} */ (this.rods.get(rod.id));
      if (recent) facts.recent += 1;
      facts.newestMs = Math.max(facts.newestMs, atMs);
    }
  }

  /** @param {PlanePose} pose @returns {(xM: number, yM: number) => boolean} */
  #insideOf({ x_m, y_m, theta_rad }) {
    const [cos, sin] = [Math.cos(theta_rad), Math.sin(theta_rad)];
    const [halfU, halfV] = this.half;
    return (xM, yM) => Math.abs((xM - x_m) * cos + (yM - y_m) * sin) <= halfU && Math.abs((yM - y_m) * cos - (xM - x_m) * sin) <= halfV;
  }

  /** @param {number} xM */
  #column(xM) { return Math.min(this.columns - 1, Math.max(0, Math.floor(xM / this.cellM))); }

  /** @param {number} yM */
  #row(yM) { return Math.min(this.rows - 1, Math.max(0, Math.floor((this.pond.height_m - yM) / this.cellM))); }
}
