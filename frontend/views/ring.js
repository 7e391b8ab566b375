// @ts-check
/** A ring round a rod in one of its snapshots. */

import { inPicture } from '../map/frame.js';
import { h } from './dom.js';

/**
 * To lie in an element of class `picture` over the snapshot.
 * @param {PlanePose} pose of the snapshot @param {Camera} camera @param {RodPlace} rod @param {'raw' | 'corrected'} kind of the pose
 */
export function ring(pose, camera, rod, kind) {
  const { u, v } = inPicture(pose, camera, rod.x_m, rod.y_m);
  const element = h('span', { class: `ring ${kind}` });
  const share = (/** @type {number} */ value) => `${(100 * value).toFixed(2)}%`;
  Object.assign(element.style, { left: share(u), top: share(v), width: share((2 * rod.outer_radius_m) / (camera.width_px * camera.metres_per_pixel)) });
  return element;
}
