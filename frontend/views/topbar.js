// @ts-check
/** The bar on top: where one is, whether the link is alive, and how old the picture is. */

import * as format from '../state/format.js';
import { endOf, standing } from '../state/review.js';
import { isOld } from '../state/robots.js';
import { h, setAttribute, setText } from './dom.js';
import { toggleTheme } from './theme.js';

const LINK_WORDS = {
  connecting: 'Connecting…', live: 'Live', reconnecting: 'Reconnecting…', disconnected: 'DISCONNECTED', refused: 'NOT FOUND',
};

export class TopBar {
  #title = h('h1');
  #state = h('span', { class: 'badge' });
  #link = h('span', { class: 'link', role: 'status', id: 'link-state' });
  #age = h('b', { id: 'data-age' });
  #ageBox;
  #ringing = 0;

  /** @param {HTMLElement[]} actions buttons of the page, at the right end */
  constructor(actions = []) {
    this.#ageBox = h('span', { class: 'age', title: 'Since the newest snapshot came to the server' }, h('span', { class: 'quiet', text: 'Newest data' }), this.#age);
    const home = h('a', { class: 'brand', href: '/?inspections', title: 'All inspections' }, h('img', { src: '/style/icon.svg', alt: '' }), h('span', { text: 'Pondwatch' }));
    const theme = h('button', { type: 'button', id: 'theme', title: 'Light or dark (T)', onClick: toggleTheme, text: 'Theme' });
    this.element = h('header', { class: 'topbar' }, home, this.#title, this.#state, h('span', { class: 'spacer' }), this.#ageBox, this.#link, ...actions, theme);
    this.#ageBox.hidden = this.#link.hidden = this.#state.hidden = true;
  }

  /** @param {string} text */
  set title(text) {
    setText(this.#title, text);
    document.title = `${this.#ringing ? `(${this.#ringing}) ` : ''}${text} · Pondwatch`;
  }

  /** Of a page without a feed: whether the server is heard. @param {import('../live/heartbeat.js').Heartbeat} beat */
  watch(beat) {
    const tell = () => {
      this.#link.hidden = beat.state === 'live';
      this.#showLink(beat.state, LINK_WORDS[beat.state], beat.silenceMs);
    };
    beat.addEventListener('state', tell);
    tell();
  }

  /** @param {keyof typeof LINK_WORDS | 'final' | 'review'} state @param {string} words @param {number} silenceMs */
  #showLink(state, words, silenceMs) {
    setText(this.#link, state === 'disconnected' ? `${words} ${format.age(silenceMs / 1000)}` : words);
    setAttribute(this.#link, 'data-state', state);
  }

  /**
   * @param {import('../state/inspection.js').Inspection} inspection
   * @param {import('../live/link.js').Link} link @param {number} nowMs
   * @param {number | null} atMs the moment under review; null: live
   */
  update(inspection, link, nowMs, atMs) {
    this.#ringing = inspection.alarms.ringing;
    this.title = inspection.facts.name || inspection.facts.id;
    const end = endOf(inspection.facts);
    this.#link.hidden = this.#state.hidden = false;
    this.#ageBox.hidden = end !== null || atMs !== null; // of what is over, or not shown, an age would say that news is
    setText(this.#state, inspection.facts.state);
    const { state, words } = standing(link.state, atMs, inspection.facts);
    this.#showLink(state, words ?? LINK_WORDS[link.state], link.silenceMs);
    const ageMs = inspection.ageMs(nowMs);
    setAttribute(this.#ageBox, 'data-old', isOld(inspection.facts, ageMs) ? '' : null);
    setText(this.#age, ageMs === null ? 'none yet' : format.age(ageMs / 1000));
  }
}
