// @ts-check
/** Health of the picture: how quick, how sure, how fresh; and where to look next. */

import * as format from '../state/format.js';
import { h, setText } from './dom.js';

const ROWS = {
  rate: 'Snapshots', latency: 'Upload to here', queue: 'Not yet corrected', noise: 'Poses were off by', twice: 'Seen twice in 30 min', next: 'Look next',
};

/** @typedef {keyof typeof ROWS} Row */

export class Health {
  /** @type {Map<Row, HTMLElement>} */ #values = new Map();
  #go = h('button', { type: 'button', id: 'look-next' });

  /** @param {() => void} goNext */
  constructor(goNext) {
    this.#go.addEventListener('click', goNext);
    const rows = /** @type {[Row, string][]} */ (Object.entries(ROWS)).flatMap(([name, word]) => {
      const value = h('dd', { id: `health-${name}` });
      this.#values.set(name, value);
      return [h('dt', { text: word }), value];
    });
    this.#values.get('next')?.append(this.#go);
    this.element = h('section', {}, h('h2', { text: 'Health of the picture' }), h('dl', { class: 'facts' }, ...rows));
  }

  /**
   * @param {import('../state/pulse.js').Pulse} pulse @param {import('../state/inspection.js').Inspection} inspection
   * @param {import('../state/looks.js').Looks | null} looks
   */
  update(pulse, inspection, looks) {
    this.#write('rate', `${pulse.perSecond.toFixed(1)} a second`);
    this.#write('latency', pulse.latencyMs === null ? format.NONE : `${format.delay(pulse.latencyMs)}, at worst ${format.delay(pulse.worstMs)}`);
    this.#write('queue', format.count(inspection.facts.counts?.pending));
    this.#write('noise', format.length(inspection.meanDriftM));
    this.#write('twice', format.percent(looks?.twiceShare, 1));
    const next = looks?.next;
    this.#go.hidden = !next;
    if (next) setText(this.#go, `${next.xM.toFixed(2)}, ${next.yM.toFixed(2)} m · ${next.rods} rods`);
  }

  /** @param {Row} row @param {string} text */
  #write(row, text) { setText(/** @type {HTMLElement} */ (this.#values.get(row)), text); }
}
