// @ts-check
/** Health of the picture: how quick, how sure, how fresh; and where to look next. */

import * as format from '../state/format.js';
import { SAMPLES } from '../state/pulse.js';
import { h, setText } from './dom.js';
import { Trend } from './trend.js';

const ROWS = {
  rate: 'Snapshots', latency: 'Upload to here', queue: 'Not yet corrected', noise: 'Poses were off by', twice: 'Coverage', next: 'Look next',
};
const TRENDS = /** @type {const} */ (['rate', 'latency', 'queue']);

/** @typedef {keyof typeof ROWS} Row */

export class Health {
  /** @type {Map<Row, HTMLElement>} */ #values = new Map();
  /** @type {Map<Row, Trend>} */ #trends = new Map(TRENDS.map((name) => [name, new Trend(ROWS[name])]));
  #title = h('h2', { id: 'health-title' });
  #go = h('button', { type: 'button', id: 'look-next', title: 'Show it on the map (N)' });

  /** @param {() => void} goNext */
  constructor(goNext) {
    this.#go.addEventListener('click', goNext);
    const rows = /** @type {[Row, string][]} */ (Object.entries(ROWS)).flatMap(([name, word]) => {
      const value = h('span', { id: `health-${name}` });
      this.#values.set(name, value);
      return [h('dt', { text: word }), h('dd', {}, value, this.#trends.get(name)?.element)];
    });
    this.#values.get('next')?.append(this.#go);
    this.element = h('section', {}, this.#title, h('dl', { class: 'facts' }, ...rows));
  }

  /**
   * @param {import('../state/pulse.js').Pulse} pulse @param {import('../state/inspection.js').Inspection} inspection
   * @param {import('../state/looks.js').Looks | null} looks
   */
  update(pulse, inspection, looks) {
    setText(this.#title, inspection.heldAtMs === null ? 'Health of the picture' : 'Health of the picture now; coverage then');
    this.#write('rate', format.figure(pulse.perSecond, 1, 'a second').replace('a ', 'a\u00a0'));
    this.#write('latency', pulse.latencyMs === null ? format.NONE : `${format.delay(pulse.latencyMs)}, worst ${format.delay(pulse.worstMs)}`);
    this.#write('queue', format.count(inspection.heldAtMs === null ? inspection.facts.counts?.pending : pulse.samples.at(-1)?.queue));
    this.#write('noise', format.length(inspection.meanDriftM));
    const twice = looks?.twiceShare;
    this.#write('twice', twice == null ? format.NONE : `${format.percent(twice, 1)} of rods seen at least twice in 30 minutes`);
    this.#trends.get('rate')?.show(pulse.samples.map(({ rate }) => rate), SAMPLES);
    this.#trends.get('latency')?.show(pulse.samples.map(({ latencyMs }) => latencyMs), SAMPLES);
    this.#trends.get('queue')?.show(pulse.samples.map(({ queue }) => queue), SAMPLES);
    const next = looks?.next;
    this.#go.hidden = !next;
    if (next) setText(this.#go, `${format.spot(next.xM, next.yM)} · ${next.rods} rods`);
  }

  /** @param {Row} row @param {string} text */
  #write(row, text) { setText(/** @type {HTMLElement} */ (this.#values.get(row)), text); }
}
