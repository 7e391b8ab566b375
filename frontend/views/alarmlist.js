// @ts-check
/** All alarms as a table over the map: those in sight, those set aside, and what became of all. Acts go to the chosen. */

import { Problem, alarmEvents } from '../api/client.js';
import { ACTS, ACT_WORDS, adviceOf, callOf, levelOf, messageOf, nameOf, open, stateWords } from '../state/alarms.js';
import * as format from '../state/format.js';
import { mark } from './alarmmark.js';
import { h, setAttribute, setText } from './dom.js';

/** @typedef {import('../state/alarms.js').Alarm} Alarm */
/** @typedef {import('../state/alarms.js').Act} Act */
/** @typedef {'current' | 'aside' | 'history'} Tab */

/** @type {Record<Tab, string>} */
const TABS = { current: 'In sight', aside: 'Set aside', history: 'History' };
const NONE = { current: 'No alarm is in sight. Those that are over stand under History.', aside: 'No alarm is set aside.', history: '' };
const HEADS = ['Chosen', 'Severity', 'Alarm', 'State', 'For', 'Times', 'What is wrong', 'What to do', 'Last said'];
const EVENT_HEADS = ['When', 'Alarm', 'What', 'By', 'Why'];
/** @type {Record<Act, string>} */
export const ACT_KEYS = { acknowledge: 'q', shelve: 's', unshelve: 'u', suppress: 'x', unsuppress: 'j', 'remove-from-service': 'o', 'return-to-service': 'w', reset: 'z' };
const MOST_ROWS = 500;

export class AlarmList {
  #alarms;
  #ask;
  #go;
  #session;
  /** @type {Tab} */ #tab = 'current';
  /** @type {Set<number>} */ #chosen = new Set();
  #shown = '';
  /** @type {{cell: HTMLElement, since: number}[]} */ #ages = [];
  /** @type {Map<Tab, HTMLElement>} */ #tabs = new Map();
  /** @type {Map<Act, HTMLButtonElement>} */ #acts = new Map();
  #body = h('div', { class: 'table-scroll', tabindex: '0', role: 'region', 'aria-label': 'Alarms' });
  #all = h('button', { type: 'button', id: 'alarm-all', onClick: () => this.#chooseAll() });
  #close;

  /** @param {{session: string, alarms: import('../state/alarms.js').Alarms, ask: (act: Act, alarms: Alarm[]) => void, go: (alarm: Alarm) => void, extra: HTMLElement}} uses @param {() => void} close */
  constructor({ session, alarms, ask, go, extra }, close) {
    this.#session = session;
    this.#alarms = alarms;
    this.#ask = ask;
    this.#go = go;
    this.#close = close;
    for (const [tab, text] of /** @type {[Tab, string][]} */ (Object.entries(TABS))) this.#tabs.set(tab, h('button', { type: 'button', 'data-tab': tab, text, onClick: () => this.#show(tab) }));
    for (const act of ACTS) this.#acts.set(act, h('button', { type: 'button', 'data-act': act, title: `${ACT_WORDS[act]} (${ACT_KEYS[act].toUpperCase()})`, text: ACT_WORDS[act], onClick: () => this.run(act) }));
    const back = h('button', { type: 'button', text: 'Back to the map', onClick: () => this.#close() });
    this.element = h('section', { class: 'tables', id: 'alarm-list', 'aria-label': 'All alarms', hidden: true },
      h('div', { class: 'toolbar' }, ...this.#tabs.values(), this.#all, h('span', { class: 'spacer' }), back),
      h('div', { class: 'toolbar acts', role: 'toolbar', 'aria-label': 'What is done to the chosen alarms' }, ...this.#acts.values()), this.#body, extra);
    this.element.addEventListener('keydown', (event) => this.#move(event));
  }

  /** @param {boolean} isOpen */
  toggle(isOpen) {
    this.element.hidden = !isOpen;
    if (!isOpen) return;
    this.#show('current');
    (this.#rows()[0] ?? this.#tabs.get('current'))?.focus();
  }

  /** Do something to the chosen alarms, or to the one that has the focus. @param {Act} act */
  run(act) {
    const focused = Number(/** @type {HTMLElement} */ (document.activeElement)?.dataset?.alarm);
    const ids = this.#chosen.size ? [...this.#chosen] : focused ? [focused] : [];
    this.#ask(act, open(ids.flatMap((id) => this.#alarms.get(id) ?? []), act));
  }

  /** @param {number} nowMs the server's clock */
  update(nowMs) {
    if (this.element.hidden) return;
    const shown = `${this.#tab} ${this.#alarms.version} ${[...this.#chosen].join()}`;
    if (this.#tab !== 'history' && shown !== this.#shown) this.#draw(shown);
    for (const { cell, since } of this.#ages) setText(cell, format.age((nowMs - since) / 1000));
  }

  /** @param {Tab} tab */
  #show(tab) {
    this.#tab = tab;
    this.#shown = '';
    this.#ages = [];
    for (const [name, button] of this.#tabs) setAttribute(button, 'aria-pressed', String(name === tab));
    this.#all.hidden = tab === 'history';
    if (tab === 'history') void this.#history();
    else this.update(0);
  }

  /** @param {string} shown */
  #draw(shown) {
    const alarms = this.#tab === 'aside' ? this.#alarms.aside : this.#alarms.current;
    this.#chosen = new Set([...this.#chosen].filter((id) => alarms.some((alarm) => alarm.id === id)));
    const held = /** @type {HTMLElement} */ (document.activeElement)?.dataset?.alarm;
    const at = this.#rows().findIndex((row) => row === document.activeElement);
    this.#shown = shown;
    this.#ages = [];
    const rows = alarms.slice(0, MOST_ROWS).map((alarm) => this.#row(alarm));
    const more = alarms.length > MOST_ROWS ? `; the first ${MOST_ROWS} are shown` : '';
    this.#body.replaceChildren(rows.length ? table(`${alarms.length} alarms ${TABS[this.#tab].toLowerCase()}${more}`, HEADS, rows) : h('p', { class: 'quiet', text: NONE[this.#tab] }));
    this.#all.disabled = rows.length === 0;
    setText(this.#all, this.#chosen.size ? 'Choose none (E)' : 'Choose all (E)');
    const targets = [...this.#chosen].flatMap((id) => this.#alarms.get(id) ?? []);
    for (const [act, button] of this.#acts) button.disabled = alarms.length === 0 || (targets.length > 0 && open(targets, act).length === 0);
    if (at >= 0) (this.#rows().find((row) => row.dataset.alarm === held) ?? this.#rows()[Math.min(at, rows.length - 1)] ?? this.#tabs.get(this.#tab))?.focus();
  }

  /** @param {Alarm} alarm */
  #row(alarm) {
    const { id } = alarm;
    const isChosen = this.#chosen.has(id);
    const choose = h('button', { type: 'button', class: 'plain choose', 'data-alarm': id, 'aria-pressed': String(isChosen), 'aria-label': `Choose ${nameOf(alarm)}`, text: isChosen ? '☑' : '☐', onClick: () => this.#choose(id) });
    const cell = h('span');
    this.#ages.push({ cell, since: Date.parse(alarm.since) });
    const go = h('button', { type: 'button', class: 'plain', text: nameOf(alarm), onClick: () => this.#go(alarm) });
    const said = alarm.comment ? `${alarm.comment.by}, ${format.moment(alarm.comment.at)}: ${alarm.comment.text}` : format.NONE;
    return [choose, mark(levelOf(alarm.severity), callOf(alarm)), go, stateWords(alarm, format.moment), cell, String(alarm.occurrences), format.sentence(messageOf(alarm)), adviceOf(alarm, this.#alarms.early), said];
  }

  /** @param {number} id */
  #choose(id) {
    if (!this.#chosen.delete(id)) this.#chosen.add(id);
    this.update(0);
  }

  /** Choose all that are listed, or none. */
  #chooseAll() {
    const listed = this.#tab === 'aside' ? this.#alarms.aside : this.#alarms.current;
    this.#chosen = new Set(this.#chosen.size ? [] : listed.map(({ id }) => id));
    this.update(0);
  }

  /** @returns {HTMLElement[]} */
  #rows() { return [...this.#body.querySelectorAll('button.choose')].filter((row) => row instanceof HTMLElement); }

  /** Up and down go from row to row. @param {KeyboardEvent} event */
  #move(event) {
    if (event.key === 'e' && !event.ctrlKey && !event.metaKey && !event.altKey && this.#tab !== 'history' && !(event.target instanceof HTMLSelectElement)) this.#chooseAll();
    const rows = this.#rows();
    const at = rows.findIndex((row) => row === document.activeElement);
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (!step || at < 0) return;
    event.preventDefault();
    rows[Math.min(rows.length - 1, Math.max(0, at + step))].focus();
  }

  /** @param {number | null} before */
  async #history(before = null) {
    try {
      const { events, next } = await alarmEvents(this.#session, before);
      if (this.#tab !== 'history') return;
      const rows = events.map(({ at, title, subject, act, by, text }) => [format.moment(at), nameOf(/** @type {any} */ ({ title, subject })), act, by ?? 'Pondwatch', text]);
      const older = next !== null && h('button', { type: 'button', text: 'Older', onClick: () => void this.#history(next) });
      this.#body.replaceChildren(table(before === null ? 'What became of the alarms, the newest first' : 'Older', EVENT_HEADS, rows), older || '');
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      this.#body.replaceChildren(h('p', { class: 'note bad', role: 'alert', text: error.message }));
    }
  }
}

/** @param {string} caption @param {string[]} heads @param {(string | Node)[][]} rows */
function table(caption, heads, rows) {
  return h('table', {}, h('caption', { text: caption }), h('thead', {}, h('tr', {}, ...heads.map((text) => h('th', { scope: 'col', text })))),
    h('tbody', {}, ...rows.map((cells) => h('tr', {}, ...cells.map((cell) => h('td', {}, cell))))));
}
