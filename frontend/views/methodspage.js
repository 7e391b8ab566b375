// @ts-check
/** A finished inspection corrected again by another method: which verdicts differ. Both results are kept. */

import { getSession } from '../api/client.js';
import { compareMethods, correctAgain, methodsOf } from '../api/ponds.js';
import { format as addressOf } from '../state/address.js';
import * as format from '../state/format.js';
import { isRunning } from '../state/robots.js';
import { reading } from './changelist.js';
import { evidenceOf } from './changedetail.js';
import { h } from './dom.js';
import { navigation } from './nav.js';
import { Fault, formOf, labelled, tableOf } from './pagekit.js';
import { TopBar } from './topbar.js';

const LOOK_MS = 1000;
/** What each makes of the same snapshots; which there are, the server says. @type {Record<string, string>} */
const WORDS = {
  lattice: 'lattice: joint decision over all snapshots', 'lattice-network': 'lattice-network: the same, rods found by a network', graph: 'graph: pairs of snapshots, without the layout',
  identity: 'identity: as the robots said',
};
const STATES = { empty: 'Empty', partial: 'Partial', full: 'Full', unseen: 'Not observed' };

export class MethodsPage {
  #bar = new TopBar([navigation()]);
  #fault = new Fault();
  #form = h('div');
  #results = h('div', { id: 'methods' });
  #verdicts = h('div', { id: 'verdicts' });
  #evidence = h('div', { id: 'evidence' });
  #session;
  #with;
  /** @type {number | undefined} */ #timer;

  /** @param {string} search */
  constructor(search) {
    const query = new URLSearchParams(search);
    this.#session = query.get('methods') ?? '';
    this.#with = query.get('with') ?? '';
    this.#bar.title = 'Again with another method';
    this.element = h('div', {}, this.#bar.element, h('main', { class: 'page wide' }, h('h2', { text: 'Again with another method' }), this.#fault.element, this.#form, this.#results, this.#verdicts, this.#evidence));
  }

  get figures() { return {}; }

  async start() {
    await this.#fault.tell(async () => {
      const facts = await getSession(this.#session);
      this.#bar.title = `Methods · ${facts.name}`;
      if (!this.#form.childElementCount) this.#form.replaceChildren(isRunning(facts.state) ? h('p', { class: 'note', text: `The inspection is ${facts.state}: it can be corrected again once it is finished.` }) : this.#ask(await methodsOf(this.#session)));
      this.#show(facts);
      clearTimeout(this.#timer);
      if (facts.corrections?.some(({ state }) => state === 'queued' || state === 'running')) this.#timer = setTimeout(() => void this.start(), LOOK_MS);
      if (this.#with && facts.corrections?.some(({ method, state }) => method === this.#with && state === 'done')) await this.#compare();
    });
  }

  /** @param {{own: string, methods: string[]}} there */
  #ask({ own, methods }) {
    const others = methods.filter((method) => method !== own);
    if (!others.length) return h('p', { class: 'note', text: 'The server has no other method for this inspection.' });
    const select = h('select', { id: 'method', name: 'method' }, ...others.map((value) => h('option', { value, text: WORDS[value] ?? value })));
    const send = async () => {
      this.#with = select.value;
      history.replaceState(null, '', `/?methods=${this.#session}&with=${this.#with}`);
      this.#verdicts.replaceChildren();
      await correctAgain(this.#session, select.value);
      await this.start();
    };
    return formOf({ id: 'method-form', word: 'Correct again', send }, labelled('By', select));
  }

  /** @param {SessionFacts} facts */
  #show({ id, method, finished_at: at, quality, corrections = [] }) {
    const own = [h('strong', { text: method ?? '' }), 'the inspection\'s own', format.moment(at), quality?.sentence ?? '', ''];
    const rows = corrections.map((one) => [one.method, one.error ? `${one.state}: ${one.error}` : one.state, format.moment(one.finished_at), one.quality.sentence,
      one.state === 'done' ? h('a', { href: `/?methods=${id}&with=${one.method}`, text: 'Which verdicts differ' }) : '']);
    this.#results.replaceChildren(tableOf('Results of this inspection; all are kept', ['Method', 'State', 'Made', 'Quality', ''], [own, ...rows]));
  }

  async #compare() {
    const { base, with: other, rods, same } = await compareMethods(this.#session, this.#with);
    const counts = Object.entries(STATES).map(([state, word]) => [word, String(base.counts[state]), String(other.counts[state])]);
    const rows = rods.map((rod) => [h('button', { type: 'button', class: 'plain', text: rod.rod_id, onClick: () => void this.#look(rod.rod_id) }), said(rod.base), said(rod.with), format.percent(rod.p_differ, 1)]);
    this.#verdicts.replaceChildren(h('h3', { text: `${base.method} against ${other.method}` }),
      h('p', { id: 'differing', text: rods.length ? `${rods.length} verdicts differ; ${same} are the same.` : `No verdict differs; all ${same} are the same.` }),
      rods.length ? tableOf('Rods whose verdicts differ', ['Rod', base.method, other.method, 'They differ'], rows) : '',
      h('details', {}, h('summary', { text: 'Rods by state' }), tableOf('Rods by state', ['State', base.method, other.method], counts)));
  }

  /** @param {string} rod */
  async #look(rod) {
    await this.#fault.tell(async () => {
      this.#evidence.replaceChildren(h('h3', { text: `Rod ${rod}` }), h('div', { class: 'before-after one' }, await evidenceOf('Snapshots behind it', { session: this.#session, name: 'this inspection' }, rod)),
        h('p', {}, h('a', { href: addressOf({ session: this.#session, rod }), text: 'Correct by hand, or write a note' })));
      this.#evidence.scrollIntoView({ block: 'nearest' });
    });
  }
}

/** @param {SideReading} side */
function said(side) {
  return side.state === 'unseen' ? 'not observed' : `${reading(side)}, ${format.percent(side.confidence, 1)} sure`;
}
