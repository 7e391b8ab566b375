// @ts-check
/** Alarms at the top of the side panel, the worst first; a kind of many is one line. Each says what to do. */

import { FLOOD, adviceOf, callOf, levelOf, messageOf, nameOf, stateWords } from '../state/alarms.js';
import * as format from '../state/format.js';
import { mark } from './alarmmark.js';
import { h, setText } from './dom.js';

/** @typedef {import('../state/alarms.js').Alarm} Alarm */
/** @typedef {import('../state/alarms.js').Alarms} Alarms */
/** @typedef {{acknowledge: (alarms: Alarm[]) => void, go: (alarm: Alarm) => void, list: () => void}} Uses */

const SHOWN = FLOOD;

export class AlarmPanel {
  #uses;
  #title = h('h2', { id: 'alarms-title' });
  #list = h('ul', { class: 'alarm-lines', id: 'alarm-lines' });
  #notes = h('ul', { class: 'alarm-lines' });
  #more = h('button', { type: 'button', id: 'alarm-more', title: 'All alarms and their history (A)' });
  #shown = -1;
  #noted = '';
  /** @type {{age: HTMLElement, since: number}[]} */ #ages = [];
  element = h('section', { id: 'alarms', 'aria-labelledby': 'alarms-title' }, this.#title, this.#list, this.#notes, this.#more);

  /** @param {Uses} uses */
  constructor(uses) {
    this.#uses = uses;
    this.#more.addEventListener('click', uses.list);
  }

  /** @param {Alarms} alarms @param {import('../state/attention.js').Note[]} notes @param {number} nowMs the server's clock @param {boolean} live */
  update(alarms, notes, nowMs, live) {
    if (this.#shown !== alarms.version) this.#draw(alarms);
    setText(this.#title, titleOf(alarms, live));
    for (const { age, since } of this.#ages) setText(age, format.age((nowMs - since) / 1000));
    const noted = notes.map(({ text }) => text).join('\n');
    if (noted === this.#noted) return;
    this.#noted = noted;
    this.#notes.replaceChildren(...notes.map(({ severity, text, advice }) => h('li', { 'data-level': levelOf(severity).name },
      mark(levelOf(severity), 'active'), h('div', { class: 'what' }, h('strong', { text }), h('span', { text: advice })))));
  }

  /** @param {Alarms} alarms */
  #draw(alarms) {
    this.#shown = alarms.version;
    const held = document.activeElement instanceof HTMLElement && this.#list.contains(document.activeElement) ? document.activeElement.dataset.key : null;
    this.#ages = [];
    const lines = alarms.groups.flatMap((group) => (group.flood ? [this.#flood(group)] : group.alarms.slice(0, SHOWN).map((alarm) => this.#line(alarm, alarms.early))));
    this.#list.replaceChildren(...lines);
    const { aside } = alarms;
    setText(this.#more, aside.length ? `All alarms · ${aside.length} set aside` : 'All alarms');
    if (held) /** @type {HTMLElement | null} */ (this.#list.querySelector(`[data-key="${CSS.escape(held)}"]`) ?? this.#list.querySelector('button') ?? this.#more)?.focus();
  }

  /** @param {Alarm} alarm @param {boolean} early */
  #line(alarm, early) {
    const age = this.#age(alarm);
    const name = h('button', { type: 'button', class: 'plain', 'data-key': `go-${alarm.id}`, title: 'Show it on the map', text: nameOf(alarm), onClick: () => this.#uses.go(alarm) });
    const said = alarm.comment ? `${alarm.comment.by}: ${alarm.comment.text}` : '';
    return h('li', { 'data-alarm': alarm.id, 'data-kind': alarm.kind, 'data-level': levelOf(alarm.severity).name, 'data-call': callOf(alarm) }, mark(levelOf(alarm.severity), callOf(alarm)),
      h('div', { class: 'what' }, name, h('span', { text: format.sentence(messageOf(alarm)) }),
        h('span', { class: 'state' }, `${stateWords(alarm, format.moment)}, `, age), h('span', { class: 'advice', text: adviceOf(alarm, early) }), said && h('span', { class: 'quiet', text: said })),
      this.#button(alarm.acts.includes('acknowledge') ? [alarm] : [], `ack-${alarm.id}`, nameOf(alarm)));
  }

  /** @param {import('../state/alarms.js').Group} group */
  #flood({ kind, title, level, call, alarms, ringing, returned }) {
    const open = h('button', { type: 'button', class: 'plain', 'data-key': `go-${kind}`, title: 'List them', text: `${alarms.length} × ${title}`, onClick: this.#uses.list });
    const names = alarms.slice(0, 4).map(({ subject }) => subject).join(', ');
    return h('li', { 'data-kind': kind, 'data-level': level.name, 'data-call': call }, mark(level, call),
      h('div', { class: 'what' }, open, h('span', { text: `${names},\u00a0…` }),
        h('span', { class: 'state' }, `${floodWords(alarms.length, ringing, returned)}; the newest `, this.#age(alarms[0])), h('span', { class: 'advice', text: adviceOf(alarms[0]) })),
      this.#button(alarms.filter(({ acts }) => acts.includes('acknowledge')), `ack-${kind}`, title));
  }

  /** @param {Alarm} alarm */
  #age({ since }) {
    const age = h('span');
    this.#ages.push({ age, since: Date.parse(since) });
    return age;
  }

  /** @param {Alarm[]} alarms @param {string} key @param {string} name */
  #button(alarms, key, name) {
    const text = alarms.length > 1 ? `Ack ${alarms.length}` : 'Ack';
    return alarms.length > 0 && h('button', { type: 'button', class: 'ack', 'data-key': key, 'aria-label': `${text} ${name}`,
      title: `Acknowledge ${name} (Q for the worst)`, text, onClick: () => this.#uses.acknowledge(alarms) });
  }
}

/** Of many of a kind: how many are over, and how many nobody acknowledged. @param {number} all @param {number} ringing @param {number} returned */
function floodWords(all, ringing, returned) {
  if (returned === all) return `returned to normal, ${ringing === all ? 'not acknowledged' : `${ringing} not acknowledged`}`;
  return `${ringing} not acknowledged${returned ? `, ${returned} returned to normal` : ''}`;
}

/** In a review they are still those of now, and say so. @param {Alarms} alarms @param {boolean} live */
function titleOf({ current, ringing }, live) {
  const now = live ? '' : ' now';
  const over = current.filter(({ active }) => !active).length;
  if (over && over === current.length) return `Alarms${now} · ${over}, all returned to normal`;
  return current.length ? `Alarms${now} · ${current.length}, ${ringing} not acknowledged${over ? `, ${over} returned to normal` : ''}` : `No alarms${now}`;
}
