// @ts-check
/**
 * One inspection as the page holds it. Values are the newest of their key; `revision` is the last one held in full.
 * No DOM, no clock of its own.
 */

import { Alarms } from './alarms.js';
import { keyOf } from './snapshotkey.js';

/** @typedef {{pose: PoseRow, heardAt: number}} RobotFacts heardAt: epoch ms, the server's clock */

export class Inspection extends EventTarget {
  /** @type {number | null} */ revision = null;
  /** @type {Raster | null} */ raster = null;
  /** @type {SessionFacts} */ facts;
  /** @type {Map<string, RodRow>} */ rods = new Map();
  /** @type {Map<string, PoseRow>} */ poses = new Map();
  /** @type {Map<string, RobotFacts>} */ robots = new Map();
  /** @type {Map<string, {[field: string]: any}>} */ jobs = new Map();
  /** @type {Map<number, Note>} */ notes = new Map();
  alarms = new Alarms();
  /** Server's clock less the page's, ms. */
  clockSkewMs = 0;
  /** In a review: the moment that is held, epoch ms, the server's clock. @type {number | null} */ heldAtMs = null;
  /** Of the last `poses`: the snapshots that came while this page watched. @type {PoseRow[]} */ fresh = [];
  /** First and last arrival of a snapshot, epoch ms, the server's clock. @type {[number, number] | null} */ span = null;
  #full = false;

  /** @param {SessionFacts} facts */
  constructor(facts) {
    super();
    this.facts = facts;
  }

  /** The server's clock, or the moment that is held, epoch ms. @param {number} nowMs epoch, the page's clock */
  serverMs(nowMs) { return this.heldAtMs ?? nowMs + this.clockSkewMs; }

  /** How long ago the newest snapshot came to the server, ms; null before the first. What is decided anew of snapshots
   * that are there is no newer picture, nor is one that this page has only now. @param {number} nowMs epoch, the page's clock */
  ageMs(nowMs) { return this.span && Math.max(0, nowMs + this.clockSkewMs - this.span[1]); }

  /** The rod's row, `unseen` where nothing was ever said. @param {string} id @returns {RodRow} */
  rod(id) {
    const known = this.rods.get(id) ?? this.#unseen.get(id);
    if (known) return known;
    /** @type {RodRow} */
    const row = { rod_id: id, state: 'unseen', fill: null, confidence: 0, views: 0 };
    this.#unseen.set(id, row);
    return row;
  }
  /** @type {Map<string, RodRow>} */ #unseen = new Map();

  /** How far correction moved poses, root mean square over what is placed, m; null where none says. */
  get meanDriftM() {
    let [sum, count] = [0, 0];
    for (const { x_m, y_m, raw_x_m, raw_y_m, status } of this.poses.values()) {
      if (status !== 'placed' || x_m === null || y_m === null || raw_x_m == null || raw_y_m == null) continue;
      sum += (x_m - raw_x_m) ** 2 + (y_m - raw_y_m) ** 2;
      count += 1;
    }
    return count ? Math.sqrt(sum / count) : null;
  }

  /**
   * Take one message of the feed.
   * @param {{type: string, [field: string]: any}} message
   * @param {number} nowMs epoch, the page's clock
   */
  apply(message, nowMs) {
    switch (message.type) {
      case 'hello': this.#hello(message); break;
      case 'poses': this.#poses(message.poses); break;
      case 'rods': for (const rod of message.rods) this.rods.set(rod.rod_id, rod); break;
      case 'notes': for (const note of message.notes) this.notes.set(note.id, note); break;
      case 'alarm': this.alarms.apply(/** @type {any} */ (message)); break;
      case 'job': this.jobs.set(message.id ?? message.kind, message); break;
      case 'session': this.#complete(message); break;
      case 'beat': this.clockSkewMs = Date.parse(message.at) - nowMs; break;
    }
    this.dispatchEvent(new CustomEvent(message.type, { detail: message }));
  }

  /** @param {{[field: string]: any}} message */
  #hello(message) {
    this.raster = message.raster;
    this.alarms.clear(); // they come anew
    this.#full = message.full ?? this.revision === null;
    if (!this.#full) return;
    this.rods.clear();
    this.poses.clear();
    this.robots.clear();
    this.notes.clear();
    this.span = null;
    this.revision = null;
  }

  /** @param {PoseRow[]} poses */
  #poses(poses) {
    this.fresh = [];
    for (const pose of poses) {
      const key = keyOf(pose);
      if (!this.#full && !this.poses.has(key)) this.fresh.push(pose);
      this.poses.set(key, pose);
      this.#place(pose);
    }
  }

  /** @param {PoseRow} pose */
  #place(pose) {
    const last = this.robots.get(pose.robot)?.pose;
    const newer = !last || (pose.boot ?? 0) > (last.boot ?? 0)
      || ((pose.boot ?? 0) === (last.boot ?? 0) && pose.sequence >= last.sequence);
    const heardAt = Date.parse(pose.received_at ?? '');
    if (newer) this.robots.set(pose.robot, { pose, heardAt });
    if (!Number.isNaN(heardAt)) this.span = [Math.min(heardAt, this.span?.[0] ?? heardAt), Math.max(heardAt, this.span?.[1] ?? heardAt)];
  }

  /** @param {{[field: string]: any}} message */
  #complete(message) {
    const { type: _type, ...facts } = message;
    const pond = facts.pond ? { ...this.facts.pond, ...facts.pond } : this.facts.pond;
    this.facts = /** @type {SessionFacts} */ ({ ...this.facts, ...facts, pond });
    this.revision = message.revision;
    this.#full = false;
  }
}

/** The pond of a session that says nothing of one: its raster's extent. @param {Raster} raster @returns {Pond} */
export function pondOf(raster) {
  return { width_m: raster.width_px * raster.metres_per_pixel, height_m: raster.height_px * raster.metres_per_pixel };
}
