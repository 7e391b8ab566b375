// @ts-check
/** Where pond metres lie on the screen, for one drawing of the map. Pure. */

export class Frame {
  /**
   * @param {{widthPx: number, heightPx: number, centreM: [number, number], metresPerPx: number, pixelRatio: number}} view
   */
  constructor({ widthPx, heightPx, centreM, metresPerPx, pixelRatio }) {
    this.width = widthPx * pixelRatio;
    this.height = heightPx * pixelRatio;
    /** Device pixels a metre, and device pixels a CSS pixel. */
    this.scale = pixelRatio / metresPerPx;
    this.dpr = pixelRatio;
    this.centreM = centreM;
  }

  /** Device pixel of a pond x. @param {number} xM */
  x(xM) { return (xM - this.centreM[0]) * this.scale + this.width / 2; }

  /** Device pixel of a pond y (up in the pond, down on the screen). @param {number} yM */
  y(yM) { return (this.centreM[1] - yM) * this.scale + this.height / 2; }

  /** Whether a disc is in view. @param {number} xM @param {number} yM @param {number} radiusM */
  sees(xM, yM, radiusM) {
    const [x, y, r] = [this.x(xM), this.y(yM), radiusM * this.scale];
    return x > -r && y > -r && x < this.width + r && y < this.height + r;
  }
}

/**
 * The corners of a camera's picture on the pond floor, from the image's upper left, clockwise.
 * @param {PlanePose} pose @param {Camera} camera
 * @returns {[number, number][]} m, pond frame
 */
export function footprint({ x_m, y_m, theta_rad }, camera) {
  const [halfU, halfV] = [(camera.width_px * camera.metres_per_pixel) / 2, (camera.height_px * camera.metres_per_pixel) / 2];
  const [cos, sin] = [Math.cos(theta_rad), Math.sin(theta_rad)];
  const corners = [[-halfU, halfV], [halfU, halfV], [halfU, -halfV], [-halfU, -halfV]];
  return corners.map(([along, up]) => [x_m + cos * along - sin * up, y_m + sin * along + cos * up]);
}

/**
 * Where a place of the pond lies in a snapshot, as shares of its width and height from the upper left corner; undoes
 * `footprint`'s pose. Outside 0 to 1 the picture does not hold it.
 * @param {PlanePose} pose @param {Camera} camera @param {number} xM @param {number} yM
 * @returns {{u: number, v: number}}
 */
export function inPicture({ x_m, y_m, theta_rad }, camera, xM, yM) {
  const [dx, dy, cos, sin] = [xM - x_m, yM - y_m, Math.cos(theta_rad), Math.sin(theta_rad)];
  const [along, up] = [cos * dx + sin * dy, cos * dy - sin * dx];
  return { u: 0.5 + along / (camera.width_px * camera.metres_per_pixel), v: 0.5 - up / (camera.height_px * camera.metres_per_pixel) };
}
