// @ts-check
/** All inspections, newest first; what to do where there are none. */

import { Problem, pageOfSessions, signOfLife, startDemo } from '../api/client.js';
import { Heartbeat } from '../live/heartbeat.js';
import * as format from '../state/format.js';
import { format as addressOf } from '../state/address.js';
import { isRunning } from '../state/robots.js';
import { h, setText } from './dom.js';
import { navigation, sessionLinks } from './nav.js';
import { Fault } from './pagekit.js';
import { Handover } from './handover.js';
import { StartForm } from './startform.js';
import { TopBar } from './topbar.js';

const EVERY_MS = 1500;

export class Home {
  #bar = new TopBar([navigation('inspections')]);
  #list = h('div', {}, h('p', { class: 'quiet', text: 'Loading…' }));
  #start = new StartForm();
  #handover = new Handover();
  #search = h('input', { type: 'search', id: 'search', 'aria-label': 'Search by name', placeholder: 'Search by name…', onInput: () => this.#turnTo([]) });
  #newer = h('button', { type: 'button', id: 'newer', text: 'Newer', onClick: () => this.#turnTo(this.#befores.slice(0, -1)) });
  #older = h('button', { type: 'button', id: 'older', text: 'Older', onClick: () => this.#next && this.#turnTo([...this.#befores, this.#next]) });
  #pager = h('div', { class: 'pager' }, this.#search, h('span', { class: 'spacer' }), this.#newer, this.#older);
  #stale = h('p', { class: 'note bad', role: 'alert', id: 'stale', hidden: true });
  #body = h('main', { class: 'page', id: 'home' }, h('h2', { text: 'Inspections' }), this.#stale, this.#start.element, this.#pager, this.#list, this.#handover.element);
  /** Where each page after the first begins, as far as the one shown. @type {string[]} */ #befores = [];
  /** @type {string | null} */ #next = null;
  #asked = 0;
  #beat = new Heartbeat({ ask: signOfLife, now: Date.now, later: (run, ms) => setTimeout(run, ms) });
  #loadedAt = 0;
  #fault = '';
  #shown = '';
  /** @type {number | undefined} */ #timer;

  #opens;

  /** @param {boolean} opens go to an inspection that runs, as soon as there is one */
  constructor(opens) {
    this.#opens = opens;
    this.#bar.title = 'Inspections';
    this.element = h('div', {}, this.#bar.element, this.#body);
  }

  start() {
    this.#bar.watch(this.#beat);
    this.#beat.addEventListener('state', () => this.#tellAge());
    this.#beat.start();
    this.#handover.start();
    void this.#refresh();
  }

  stop() {
    this.#beat.stop();
    clearTimeout(this.#timer);
  }

  /** A list that is not renewed says so. */
  #tellAge() {
    const isLost = this.#beat.state === 'disconnected';
    this.#stale.hidden = !isLost && !this.#fault;
    const list = this.#loadedAt ? `The list is ${format.age((Date.now() - this.#loadedAt) / 1000)} old.` : 'Nothing was received yet.';
    setText(this.#stale, `${isLost ? 'DISCONNECTED.' : this.#fault} ${list} Trying again.`);
    this.#list.classList.toggle('outdated', !this.#stale.hidden);
  }

  /** @param {string[]} befores */
  #turnTo(befores) {
    this.#befores = befores;
    clearTimeout(this.#timer);
    void this.#refresh();
  }

  async #refresh() {
    const asked = ++this.#asked;
    try {
      const { sessions, next } = await pageOfSessions({ q: this.#search.value.trim(), before: this.#befores.at(-1) ?? null });
      if (asked !== this.#asked) return;
      this.#next = next ?? null;
      this.#loadedAt = Date.now();
      this.#fault = '';
      const running = this.#opens && sessions.find((facts) => isRunning(facts.state));
      if (running) return location.replace(addressOf({ session: running.id }));
      this.#show(sessions);
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      if (asked !== this.#asked) return;
      this.#fault = error.message;
    }
    this.#tellAge();
    this.#timer = setTimeout(() => void this.#refresh(), EVERY_MS);
  }

  /** Its inspection is opened as soon as it is there. */
  async #demo() {
    await startDemo();
    this.#opens = true;
  }

  /** @param {SessionFacts[]} sessions */
  #show(sessions) {
    const searching = Boolean(this.#search.value.trim());
    this.#newer.disabled = !this.#befores.length;
    this.#older.disabled = !this.#next;
    this.#newer.hidden = this.#older.hidden = this.#newer.disabled && this.#older.disabled; // one page is all
    this.#pager.hidden = !sessions.length && !searching && !this.#befores.length;
    this.#start.offer(sessions);
    const now = JSON.stringify([sessions, searching]);
    if (now === this.#shown) return;
    this.#shown = now;
    const nothing = () => (searching ? h('p', { class: 'note', text: 'No inspection has such a name.' }) : welcome(() => this.#demo()));
    this.#list.replaceChildren(sessions.length ? table(sessions) : nothing());
  }
}

/** @param {SessionFacts[]} sessions */
function table(sessions) {
  const heads = ['Inspection', 'State', 'Started'].map((text) => h('th', { scope: 'col', text }));
  const numbers = ['Snapshots', 'Rods read', 'Floor seen'].map((text) => h('th', { scope: 'col', class: 'number', text }));
  numbers.push(h('th', { scope: 'col', text: 'More' }));
  return h('table', {}, h('thead', {}, h('tr', {}, ...heads, ...numbers)), h('tbody', {}, ...sessions.map(row)));
}

/** @param {SessionFacts} session */
function row(session) {
  return h('tr', {},
    h('td', {}, h('a', { href: addressOf({ session: session.id }), text: session.name || session.id })),
    h('td', {}, h('span', { class: 'badge', text: session.state })),
    h('td', { text: format.moment(session.created_at) }),
    h('td', { class: 'number', text: format.count(session.counts?.snapshots) }),
    h('td', { class: 'number', text: session.rods ? `${format.count(session.rods_seen)} of ${format.count(session.rods)}` : 'no layout' }),
    h('td', { class: 'number', text: format.percent(session.coverage) }),
    h('td', {}, h('span', { class: 'more-links' }, ...sessionLinks(session))));
}

/** @param {() => Promise<void>} demo */
function welcome(demo) {
  const fault = new Fault();
  const begins = h('p', { role: 'status', id: 'demo-begins' });
  const button = h('button', { type: 'button', id: 'start-demo', class: 'primary', text: 'Start the demo inspection', onClick: async () => {
    button.disabled = true;
    begins.textContent = 'Simulated robots set out; their first snapshots come within seconds.';
    if (await fault.tell(demo)) return;
    begins.textContent = '';
    button.disabled = false;
  } });
  return h('div', { class: 'note' },
    h('p', {}, h('strong', { text: 'There is no inspection yet.' })),
    h('p', { text: 'A base station starts one when it begins to upload; this page shows it as soon as it does.' }),
    h('p', { text: 'To see how one looks, let seven simulated robots inspect a simulated pond:' }), h('p', {}, button), begins, fault.element,
    h('p', { text: 'To upload a recorded session:' }), command(`pondwatch upload BUNDLE --url ${location.origin}`));
}

/** A line for a terminal, with a button that takes it to the clipboard where the browser allows that. @param {string} text */
function command(text) {
  const copy = h('button', { type: 'button', text: 'Copy', 'aria-label': `Copy: ${text}`, hidden: !navigator.clipboard, onClick: async () => {
    await navigator.clipboard.writeText(text);
    copy.textContent = 'Copied';
  } });
  return h('p', { class: 'command' }, h('code', { text }), copy);
}
