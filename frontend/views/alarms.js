// @ts-check
/** Alarms in the page: the panel, the list, the dialog, the count in the top bar. Here they are put together. */

import { Problem, alarmsOf } from '../api/client.js';
import { ACT_WORDS, ACTS, nameOf, open } from '../state/alarms.js';
import { attentionOf } from '../state/attention.js';
import { isEarly } from '../state/deciding.js';
import { AlarmDialog } from './alarmdialog.js';
import { ACT_KEYS, AlarmList } from './alarmlist.js';
import { AlarmPanel } from './alarmpanel.js';
import { Baseline } from './baseline.js';
import { h, setAttribute, setText } from './dom.js';

/** @typedef {import('../state/alarms.js').Alarm} Alarm */
/** @typedef {import('../state/inspection.js').Inspection} Inspection */

export class AlarmDesk {
  #inspection;
  #go;
  /** @type {Set<number>} */ #told = new Set();
  #version = -1;
  #spoken = h('div', { class: 'visually-hidden', role: 'status', id: 'alarm-spoken' });
  button = h('button', { type: 'button', id: 'alarm-count', onClick: () => this.toggle() });

  /** @param {Inspection} inspection @param {(alarm: Alarm) => void} go to what an alarm is about */
  constructor(inspection, go) {
    this.#inspection = inspection;
    this.#go = (/** @type {Alarm} */ alarm) => { this.close(); go(alarm); };
    const { facts: { id }, alarms } = inspection;
    this.dialog = new AlarmDialog(id);
    this.baseline = new Baseline(() => this.#inspection.facts);
    const ask = this.dialog.ask.bind(this.dialog);
    this.list = new AlarmList({ session: id, alarms, ask, go: this.#go, extra: this.baseline.element }, () => this.close());
    this.panel = new AlarmPanel({ acknowledge: (some) => ask('acknowledge', some), go: this.#go, list: () => this.toggle() });
    this.overlays = [this.dialog.element, this.#spoken];
    void this.#start();
  }

  /** The limits in force, for those who ask how long is silent. */
  async #start() {
    try {
      this.#inspection.alarms.limits = (await alarmsOf(this.#inspection.facts.id)).limits ?? {};
    } catch (error) {
      if (!(error instanceof Problem)) throw error; // the page has its own until then
    }
  }

  toggle() {
    const isOpen = Boolean(this.list.element.hidden);
    this.list.toggle(isOpen);
    if (isOpen) void this.baseline.open();
  }

  /** Whether there was a list to close. */
  close() {
    const wasOpen = !this.list.element.hidden;
    if (wasOpen) {
      this.list.toggle(false);
      this.button.focus();
    }
    return wasOpen;
  }

  /** @returns {import('./help.js').Action[]} */
  get actions() {
    const acts = ACTS.map((act) => ({ keys: [ACT_KEYS[act]], word: `${ACT_WORDS[act]}: the alarms chosen in the list${act === 'acknowledge' ? ', or the worst' : ''}`, run: () => this.#run(act) }));
    return [{ keys: ['a'], word: 'All alarms; E chooses all, arrows go from one to the next', run: () => this.toggle() }, ...acts];
  }

  /** @param {import('../state/alarms.js').Act} act */
  #run(act) {
    if (!this.list.element.hidden) this.list.run(act);
    else if (act === 'acknowledge') this.dialog.ask(act, open(this.#inspection.alarms.groups[0]?.alarms ?? [], act));
  }

  /** Alarms are always those of now. @param {boolean} live whether the page shows now too @param {number} nowMs the server's clock */
  update(live, nowMs) {
    const { alarms } = this.#inspection;
    alarms.tell(isEarly(this.#inspection, nowMs));
    this.panel.update(alarms, attentionOf(this.#inspection), nowMs, live);
    this.list.update(nowMs);
    if (this.#version === alarms.version) return;
    this.#version = alarms.version;
    const { worst, current } = alarms;
    const [active, returned] = [alarms.count('active'), alarms.count('returned')];
    setText(this.button, worst ? `${worst.letter} · ${active} alarm${active > 1 ? 's' : ''}` : returned ? `${returned} to acknowledge` : 'Alarms');
    setAttribute(this.button, 'data-level', worst?.name ?? null);
    setAttribute(this.button, 'title', `Not acknowledged: ${active} active, ${returned} returned to normal; ${current.length} in sight (A)`);
    this.#speak(current);
  }

  /** Say what began to ring, to those who listen to the page. @param {Alarm[]} current */
  #speak(current) {
    const fresh = current.filter(({ id, rings }) => rings && !this.#told.has(id));
    this.#told = new Set(current.filter(({ rings }) => rings).map(({ id }) => id));
    if (fresh.length) setText(this.#spoken, fresh.length > 1 ? `${fresh.length} new alarms, the worst: ${nameOf(fresh[0])}` : `New alarm: ${nameOf(fresh[0])}. ${fresh[0].advice}`);
  }
}
