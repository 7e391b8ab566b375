// @ts-check
/** The clock under the map: live, or a moment of the past. The two look different at a glance. */

import * as format from '../state/format.js';
import { SPEEDS } from '../state/review.js';
import { h, setAttribute, setText } from './dom.js';

const STEPS = 2000;

export class TimeBar {
  #clock;
  #span = [0, 1];
  #live = h('button', { type: 'button', id: 'go-live', title: 'Back to live (V)', text: 'Live' });
  #play = h('button', { type: 'button', id: 'play', title: 'Hold or replay (Space)' });
  #slider = h('input', { type: 'range', id: 'scrub', min: '0', max: String(STEPS), value: String(STEPS), disabled: true, 'aria-label': 'Moment of the inspection' });
  #label = h('span', { class: 'moment', id: 'moment' });
  #speed = h('select', { 'aria-label': 'Speed of the replay', title: 'Speed of the replay' }, ...SPEEDS.map((speed) => h('option', { value: speed, text: `${speed}×` })));

  /** @param {import('../state/review.js').Clock} clock @param {() => void} toggle */
  constructor(clock, toggle) {
    this.#clock = clock;
    this.#live.addEventListener('click', () => clock.goLive());
    this.#play.addEventListener('click', toggle);
    this.#slider.addEventListener('input', () => clock.seek(this.#span[0] + (Number(this.#slider.value) / STEPS) * (this.#span[1] - this.#span[0])));
    this.#speed.value = String(clock.speed);
    this.#speed.addEventListener('change', () => { clock.speed = Number(this.#speed.value); });
    this.element = h('div', { class: 'timebar', role: 'group', 'aria-label': 'Time' }, this.#live, this.#play, this.#slider, this.#speed, this.#label);
  }

  /** @param {[number, number] | null} span of arrivals, epoch ms @param {string | null} end words for how the inspection ended
   * @param {boolean} running whether snapshots are awaited: what ends is not called live */
  update(span, end, running) {
    const { atMs, live, playing } = this.#clock;
    if (span) this.#span = span;
    this.#slider.disabled = !span;
    setAttribute(this.element, 'data-mode', live ? (end ? 'final' : 'live') : 'review');
    setText(this.#live, end ? 'Final' : running ? 'Live' : 'Newest');
    setAttribute(this.#live, 'title', end ? 'The inspection as it ended (V)' : running ? 'Back to live (V)' : 'Back to what is known now (V)');
    setAttribute(this.#live, 'aria-pressed', String(live));
    setText(this.#play, live ? (end ? 'Replay' : 'Hold') : playing ? 'Pause' : 'Replay');
    const share = atMs === null || !span ? 1 : (atMs - span[0]) / Math.max(1, span[1] - span[0]);
    if (document.activeElement !== this.#slider || live || playing) this.#slider.value = String(Math.round(STEPS * share));
    setAttribute(this.#slider, 'aria-valuetext', live ? end ?? 'live' : format.moment(atMs));
    setText(this.#label, atMs === null ? end ?? (running ? 'now' : 'no more snapshots; the last correction is under way') : `REVIEW ${format.moment(atMs)}${span ? `, ${format.age((span[1] - atMs) / 1000)} before the newest` : ''}`);
  }
}
