// @ts-check
/** One pond: its rods through time, its inspections, the versions of its layout, what is declared, and a start there. */

import { getSession, startSession } from '../api/client.js';
import { getPond, getRodHistory, getTrends, pondPath, renamePond } from '../api/ponds.js';
import { format as addressOf } from '../state/address.js';
import { compareAddress } from '../state/comparison.js';
import * as format from '../state/format.js';
import { h } from './dom.js';
import { inventoryForm } from './inventoryform.js';
import { layoutForm } from './layoutform.js';
import { navigation, sessionLinks } from './nav.js';
import { Fault, formOf, labelled, tableOf } from './pagekit.js';
import { pastStrip, wordsOf } from './paststrip.js';
import { TopBar } from './topbar.js';
import { trendChart } from './trendchart.js';

export class PondPage {
  #bar = new TopBar([navigation('ponds')]);
  #fault = new Fault();
  #body = h('div', { class: 'pond-parts' });
  #past = h('div', { id: 'past' });
  #id;
  #rod;

  /** @param {string} search */
  constructor(search) {
    const query = new URLSearchParams(search);
    this.#id = query.get('pond') ?? '';
    this.#rod = query.get('rod') ?? '';
    this.element = h('div', {}, this.#bar.element, h('main', { class: 'page wide' }, this.#fault.element, this.#body));
  }

  get figures() { return {}; }

  async start() {
    await this.#fault.tell(async () => {
      const [pond, trend] = await Promise.all([getPond(this.#id), getTrends(this.#id)]);
      this.#show(pond, trend);
    });
  }

  /** @param {PondFacts} pond @param {Trend[]} trend */
  #show(pond, trend) {
    this.#bar.title = pond.name;
    const again = () => void this.start();
    this.#body.replaceChildren(
      h('h2', { text: pond.name }), rename(pond, again), startForm(pond),
      part('Rods through time', trendChart(trend)),
      part('One rod through all inspections', this.#rodForm(pond), this.#past),
      part('Inspections', inspections(pond.inspections)),
      part('Layout', layoutForm(pond, again), versions(pond)),
      part('Declared inventories', inventoryForm(() => pond.id, again), inventories(pond)));
    if (this.#rod) void this.#showRod();
  }

  /** @param {PondFacts} pond */
  #rodForm({ layout }) {
    const list = h('datalist', { id: 'rod-ids' }, ...(layout.rods ?? []).map(({ id }) => h('option', { value: id })));
    const input = h('input', { id: 'rod', list: 'rod-ids', required: true, value: this.#rod, maxlength: '100' });
    const send = async () => {
      this.#rod = input.value.trim();
      await this.#showRod();
    };
    return formOf({ id: 'rod-form', word: 'Show', send }, labelled('Rod', input), list);
  }

  async #showRod() {
    const past = await getRodHistory(this.#id, this.#rod);
    history.replaceState(null, '', `/?pond=${this.#id}&rod=${encodeURIComponent(this.#rod)}`);
    const rows = past.toReversed().map((one) => [h('a', { href: addressOf({ session: one.session, rod: this.#rod }), text: one.name }), format.moment(one.at), wordsOf(one), String(one.views), one.method]);
    this.#past.replaceChildren(pastStrip(past, this.#rod), h('details', {}, h('summary', { text: 'The same as a table' }), tableOf(`Rod ${this.#rod}`, ['Inspection', 'When', 'Reading', 'Looks', 'Method'], rows)));
  }
}

/** @param {string} title @param {...Node} children */
function part(title, ...children) {
  return h('section', { 'aria-label': title }, h('h3', { text: title }), ...children);
}

/** @param {PondFacts} pond @param {() => void} done */
function rename({ id, name, rods, layout_version: version }, done) {
  const input = h('input', { id: 'rename', required: true, maxlength: '200', value: name });
  const send = async () => {
    await renamePond(id, input.value.trim());
    done();
  };
  return h('div', {}, h('p', { class: 'quiet', text: `${format.count(rods)} rods, version ${version} of the layout` }),
    h('details', {}, h('summary', { text: 'Rename' }), formOf({ id: 'rename-form', word: 'Rename', send }, labelled('Name', input))));
}

/** The camera is that of the last inspection, unless it is said otherwise. @param {PondFacts} pond */
function startForm({ id, inspections: earlier }) {
  const name = h('input', { id: 'start-name', required: true, maxlength: '200' });
  const fields = /** @type {const} */ (['width_px', 'height_px', 'metres_per_pixel']).map((field) => h('input', { name: field, type: 'number', required: true, min: '0', step: 'any' }));
  const words = ['Camera: width, px', 'Camera: height, px', 'Camera: metres a pixel'];
  const send = async () => {
    const camera = Object.fromEntries(fields.map((input) => [input.name, Number(input.value)]));
    const last = earlier.length ? await getSession(earlier[0].id) : null;
    const noise = last?.pose_noise ? { pose_noise: last.pose_noise } : {};
    const made = await startSession({ format: 'pond-session/1', name: name.value.trim(), camera, pond: { id }, ...noise });
    location.assign(addressOf({ session: made.id }));
  };
  const form = formOf({ id: 'start-form', word: 'Start', send }, labelled('Name', name), h('div', { class: 'two' }, ...fields.map((input, i) => labelled(words[i], input))));
  const fold = h('details', { id: 'start' }, h('summary', { text: 'Start an inspection of this pond' }), form);
  fold.addEventListener('toggle', async () => {
    if (!fold.open || !earlier.length || fields[0].value) return;
    const { camera } = await getSession(earlier[0].id);
    if (camera) for (const input of fields) input.value = String(camera[/** @type {keyof Camera} */ (input.name)]);
  });
  return fold;
}

/** @param {PondInspection[]} listed */
function inspections(listed) {
  if (!listed.length) return h('p', { class: 'quiet', text: 'There is none yet.' });
  const choice = (/** @type {string} */ side, /** @type {string} */ id, /** @type {string} */ word, /** @type {boolean} */ checked) => h('input', { type: 'radio', name: side, value: id, 'aria-label': word, checked });
  const rows = listed.map(({ id, name, state, method, layout_version: version, coverage, created_at: start, finished_at: end }, i) => [h('a', { href: addressOf({ session: id }), text: name || id }), h('span', { class: 'badge', text: state }),
    format.moment(end ?? start), method, `version ${version ?? format.NONE}`, format.percent(coverage), choice('base', id, `${name}: before`, i === 1), choice('with', id, `${name}: after`, i === 0), h('span', { class: 'more-links' }, ...sessionLinks({ id, state }))]);
  const heads = ['Inspection', 'State', 'When', 'Method', 'Layout', 'Coverage', 'Before', 'After', 'More'];
  const send = async (/** @type {HTMLFormElement} */ form) => {
    const said = new FormData(form);
    const [base, later] = [String(said.get('base') ?? ''), String(said.get('with') ?? '')];
    if (!base || !later || base === later) throw new Error('Choose two different inspections, one before and one after.');
    location.assign(compareAddress(base, later));
  };
  return formOf({ id: 'pair-form', word: 'Compare these two', send }, tableOf(`${listed.length} inspections, the newest first`, heads, rows));
}

/** @param {PondFacts} pond */
function versions({ id, versions: listed }) {
  const link = (/** @type {number} */ version, /** @type {string} */ form) => h('a', { href: `${pondPath(id)}/layouts/${version}?format=${form}`, text: form.toUpperCase(), download: `layout-${version}.${form}` });
  const rows = listed.map(({ version, source, rods, digest, created_at: at }) => [`Version ${version}`, source, format.count(rods), format.moment(at), h('code', { text: digest.slice(7, 19), title: digest }), h('span', { class: 'more-links' }, link(version, 'csv'), link(version, 'json'))]);
  return tableOf('Versions of the layout; inspections keep the one they had', ['Version', 'From', 'Rods', 'Kept', 'Digest', 'Export'], rows);
}

/** @param {PondFacts} pond */
function inventories({ inventories: listed, inspections: done }) {
  if (!listed.length) return h('p', { class: 'quiet', text: 'None was imported yet.' });
  const rows = listed.map(({ id, name, lines, created_at: at, layout_version: version, digest }) => [name, format.count(lines), format.moment(at), `version ${version}`, h('code', { text: digest.slice(7, 19), title: digest }),
    done.length ? h('a', { href: `/?reconcile=${done[0].id}&inventory=${id}`, text: `Reconcile ${done[0].name}` }) : 'no inspection yet']);
  return tableOf('Declared inventories, the newest first', ['File', 'Lines', 'Imported', 'Checked against', 'Digest', ''], rows);
}
