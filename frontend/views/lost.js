// @ts-check
/** Over a page without a feed: that the server is not heard, and since when nothing here was renewed. */

import { signOfLife } from '../api/client.js';
import { Heartbeat } from '../live/heartbeat.js';
import * as format from '../state/format.js';
import { h, setText } from './dom.js';

/** Watches from now on. @returns {HTMLElement} */
export function lostNote() {
  const element = h('p', { class: 'lost', role: 'alert', id: 'lost', hidden: true });
  const beat = new Heartbeat({ ask: signOfLife, now: Date.now, later: (run, ms) => setTimeout(run, ms) });
  beat.addEventListener('state', () => {
    element.hidden = beat.state === 'live';
    setText(element, `DISCONNECTED. What is shown is at least ${format.age(beat.silenceMs / 1000)} old. Trying again.`);
  });
  beat.start();
  return element;
}
