// @ts-check
/** All robots, always in sight: last heard, where, and how far the correction moved the pose that came. */

import * as format from '../state/format.js';
import { isWeak, saidOf } from '../state/robots.js';
import { h, setAttribute, setText } from './dom.js';

/** @typedef {import('../state/robots.js').RobotView} RobotView */

/** Before how far the correction moved the pose; a place that is sure needs no word for that. */
const STATUS_WORDS = { placed: '', uncertain: 'uncertain', rejected: 'not placed' };

/** @type {Partial<Record<import('../state/robots.js').Hearing, (age: string) => string>>} */
const HEARD = { silent: (age) => `SILENT ${age}`, behind: (age) => `queued ${age}`, ended: () => 'ended', unknown: (age) => `? ${age}` };
/** @type {Partial<Record<import('../state/robots.js').Hearing, string>>} */
const HINTS = { silent: ', silent', behind: '; newer ones wait for their correction', unknown: '; the server is not heard' };

export class RobotStrip {
  /** @type {Map<string, Card>} */ #cards = new Map();
  #nobody = h('p', { class: 'quiet', text: 'No robot was heard yet.' });
  #choose;

  /** @param {(robot: RobotView) => void} choose */
  constructor(choose) {
    this.#choose = choose;
    this.element = h('section', { class: 'strip', id: 'robots', 'aria-label': 'Robots' }, this.#nobody);
  }

  /** @param {RobotView[]} robots */
  update(robots) {
    this.#nobody.hidden = robots.length > 0;
    if (robots.length !== this.#cards.size || robots.some(({ name }) => !this.#cards.has(name))) this.#rebuild(robots);
    for (const robot of robots) this.#cards.get(robot.name)?.update(robot);
  }

  /** @param {RobotView[]} robots */
  #rebuild(robots) {
    this.#cards = new Map(robots.map((robot) => [robot.name, new Card(robot.name, this.#choose)]));
    this.element.replaceChildren(this.#nobody, ...[...this.#cards.values()].map((card) => card.element));
  }
}

class Card {
  #state = h('span', { class: 'state' });
  #where = h('span', { class: 'line' });
  #how = h('span', { class: 'line' });
  #said = h('span', { class: 'line said' });
  /** @type {RobotView | null} */ #robot = null;

  /** @param {string} name @param {(robot: RobotView) => void} choose */
  constructor(name, choose) {
    this.element = h('button', { class: 'robot', type: 'button', 'data-robot': name, onClick: () => this.#robot && choose(this.#robot) },
      h('strong', { text: name }), this.#state, this.#where, this.#how, this.#said);
  }

  /** @param {RobotView} robot */
  update(robot) {
    this.#robot = robot;
    const { name, pose, ageS, hearing, driftM } = robot;
    setAttribute(this.element, 'data-hearing', hearing);
    setAttribute(this.element, 'title', `${name}: snapshot ${pose.sequence}${HINTS[hearing] ?? ''}; show it on the map`);
    setText(this.#state, HEARD[hearing]?.(format.age(ageS)) ?? format.age(ageS));
    setText(this.#where, pose.x_m === null || pose.y_m === null ? 'place not known'
      : `${format.spot(pose.x_m, pose.y_m)}  ${format.angle(pose.theta_rad)}`);
    setAttribute(this.#how, 'data-status', pose.status);
    setText(this.#said, saidOf(pose));
    setAttribute(this.#said, 'data-weak', isWeak(pose) ? '' : null);
    setText(this.#how, [STATUS_WORDS[pose.status], driftM === null ? '' : driftM < 5e-6 ? 'not moved' : `off ${format.length(driftM)}`].filter(Boolean).join(', '));
  }
}
