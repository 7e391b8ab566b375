// @ts-check
/** The live view: one inspection, its feed, its map and its panels. Here they are put together. */

import { world } from '../live/browserlink.js';
import { Intake } from '../live/intake.js';
import { Link } from '../live/link.js';
import { decode } from '../map/raster.js';
import { format as addressOf } from '../state/address.js';
import * as format from '../state/format.js';
import { Inspection, pondOf } from '../state/inspection.js';
import { Options } from '../state/options.js';
import { Pulse } from '../state/pulse.js';
import { robotViews } from '../state/robots.js';
import { h, setAttribute, setText } from './dom.js';
import { AddressBar } from './addressbar.js';
import { AlarmDesk } from './alarms.js';
import { Findings } from './findings.js';
import { Finish } from './finish.js';
import { Health } from './health.js';
import { helpDialog } from './help.js';
import { listen } from './keys.js';
import { actionsOf } from './liveactions.js';
import { sessionLinks } from './nav.js';
import { LayerLegend } from './layerlegend.js';
import { mapTools } from './maptools.js';
import { Notes } from './notes.js';
import { PondView } from './pondview.js';
import { RobotStrip } from './robotstrip.js';
import { RodPanel } from './rodpanel.js';
import { Summary } from './summary.js';
import { Tables } from './tables.js';
import { Toolbar } from './toolbar.js';
import { Timekeeper } from './timekeeper.js';
import { TopBar } from './topbar.js';

const CLOCK_MS = 250;
const PANELS_MS = 200;

export class Live {
  #finish;
  #findings;
  #bar;
  #summary;
  #health = new Health(() => this.#goNext());
  #legend;
  #pulse = new Pulse();
  #notes;
  #mapBox = h('div', { class: 'map', id: 'map', tabindex: '0', role: 'application', 'aria-label': 'Map of the pond; arrow keys pan, plus and minus zoom' });
  #banner = h('div', { class: 'banner', role: 'alert' }, h('strong'), h('span'));
  #wait = h('p', { class: 'wait', id: 'wait', role: 'status', text: 'Waiting for the inspection as it stands…' });
  #cursor = h('div', { class: 'cursor', hidden: true });
  #area = h('div', { class: 'map-area' }, this.#mapBox, this.#wait);
  #column = h('div', { class: 'map-column' }, this.#area);
  /** @type {PondView | null} */ #view = null;
  /** What the address asked for, until it can be had. @type {Pick<import('../state/address.js').Address, 'rod' | 'view' | 'at'>} */ #wanted;
  #address = new AddressBar(() => this.#addressOf());
  #due = false;
  #hearing = '';

  /** @param {SessionFacts} facts @param {import('../state/address.js').Address} address */
  constructor(facts, { rod, show, view, at }) {
    this.inspection = new Inspection(facts);
    this.#finish = new Finish(facts.id);
    this.alarms = new AlarmDesk(this.inspection, (alarm) => this.#goToAlarm(alarm));
    this.#bar = new TopBar([h('span', { class: 'more-links' }, ...sessionLinks(facts)), this.alarms.button, this.#finish.button]);
    this.options = new Options().read(show);
    this.#summary = new Summary(this.options);
    this.#legend = new LayerLegend(this.options);
    this.#area.append(this.#banner, this.#cursor);
    this.#column.prepend(this.#legend.notes);
    this.#column.append(this.#legend.element);
    this.time = new Timekeeper(this.inspection);
    this.#column.append(this.time.bar.element);
    this.#wanted = { rod, view, at };
    this.#findings = new Findings(facts.id, (finding) => this.#view?.goToFinding(finding));
    this.strip = new RobotStrip((robot) => this.#goToRobot(robot));
    this.rodPanel = new RodPanel(() => this.inspection.facts, () => this.time.shown);
    this.tables = new Tables(() => this.time.shown, () => this.#view?.looks ?? null, (id) => this.#find(id), () => this.tables.toggle(false));
    const middle = () => this.#view?.map.centre ?? null;
    this.#notes = new Notes({ session: facts.id, middle, moment: () => this.time.clock.atMs, go: (note) => this.#goToNote(note) });
    const side = h('aside', { class: 'side', 'aria-label': 'Overview', tabindex: '0' }, this.rodPanel.element, this.alarms.panel.element, this.#findings.element, this.#summary.element, this.#health.element, this.#notes.element);
    this.#actions = actionsOf(this, { goNext: () => this.#goNext(), close: () => this.#close(), help: () => this.help.showModal(), note: () => this.#notes.open() });
    this.help = helpDialog(this.#actions);
    this.#main = h('main', { class: 'live' }, this.#column, side, this.strip.element);
    this.element = h('div', {}, this.#bar.element, this.#main, this.help, this.#finish.dialog, ...this.alarms.overlays);
    this.link = new Link(world(facts.id), () => this.inspection.revision);
    this.intake = new Intake({
      decode,
      paint: (patch, image) => { if (patch.layer === 'mosaic') this.#view?.mosaic.paint(patch, image); },
      apply: (message) => this.inspection.apply(message, Date.now()),
      resync: () => this.link.restart(1000),
    });
  }
  #actions;
  #main;

  get view() { return this.#view; }

  start() {
    const { inspection, link, rodPanel } = this;
    link.addEventListener('frame', (event) => this.intake.push(/** @type {CustomEvent} */ (event).detail));
    link.addEventListener('state', () => this.#update());
    inspection.addEventListener('hello', () => this.#hello());
    inspection.addEventListener('poses', () => this.#pulse.arrived(inspection.fresh.map((pose) => Date.parse(pose.received_at ?? '')), this.#serverMs));
    inspection.addEventListener('session', () => this.#revision());
    for (const said of ['rods', 'notes']) inspection.addEventListener(said, () => this.#soon()); // what people say makes no revision
    rodPanel.addEventListener('choose', () => this.#showEvidence());
    rodPanel.addEventListener('close', () => this.#chooseRod(null));
    this.time.addEventListener('change', () => { this.#view?.show(this.time.shown, this.time.live); this.#address.keep(); this.#update(); });
    this.options.addEventListener('change', () => { this.#address.keep(); this.#update(); });
    addEventListener('online', () => link.restart());
    listen(this.#actions);
    setInterval(() => this.#tick(), CLOCK_MS);
    this.#update();
    link.start();
  }

  get #serverMs() { return this.inspection.serverMs(Date.now()); }

  #hello() {
    const { raster, facts, revision } = this.inspection;
    if (!raster) return;
    if (!this.#view) this.#makeView(raster, facts.pond ?? pondOf(raster));
    else if (revision === null) this.#view.mosaic.clear();
  }

  /** @param {Raster} raster @param {Pond} pond */
  #makeView(raster, pond) {
    const view = new PondView(this.#mapBox, this.inspection, raster, pond, this.options);
    view.addEventListener('choose', (event) => this.#chooseRod(/** @type {CustomEvent} */ (event).detail));
    if (this.#wanted.view) view.map.show(this.#wanted.view);
    this.#wanted.view = null;
    view.addEventListener('moved', () => this.#address.keep());
    view.addEventListener('measure', () => this.#measured(view));
    view.addEventListener('pointer', (event) => this.#point(/** @type {CustomEvent} */ (event).detail));
    this.#view = view;
    const toolbar = new Toolbar(this.options, {
      find: (id) => this.#find(id), rods: (pond.rods ?? []).map((rod) => rod.id), measure: () => view.toggleMeasure(), table: () => this.tables.toggle(true), help: () => this.help.showModal(),
    });
    this.#column.prepend(toolbar.element);
    this.#area.append(this.tables.element, this.alarms.list.element, mapTools(view));
    if (this.#wanted.rod) this.#find(this.#wanted.rod);
  }

  #revision() {
    void this.#findings.update(this.inspection.facts.state);
    const { at } = this.#wanted;
    this.#wanted.at = null;
    if (at !== null) this.time.clock.seek(at);
    if (this.inspection.revision !== null) this.#view?.painted.wait(this.inspection.revision);
    if (this.time.live) this.#view?.advance();
    this.#soon();
  }

  /** Show what is otherwise, once for all that comes together. */
  #soon() {
    this.#view?.repaint();
    if (this.#due) return;
    this.#due = true;
    setTimeout(() => this.#update(), PANELS_MS);
  }

  #update() {
    this.#due = false;
    this.#summary.update(this.time.shown);
    this.#notes.update(this.inspection.notes.values());
    this.tables.update();
    const rod = this.#view?.chosenRod;
    if (rod) this.rodPanel.show(this.time.shown.rod(rod.id), rod);
    this.#tick();
  }

  /** What changes with time alone. */
  #tick() {
    const now = Date.now();
    this.time.tick();
    this.#pulse.tick(this.#serverMs);
    this.#pulse.sample(this.#serverMs, this.inspection.facts.counts?.pending ?? null);
    this.#view?.recount();
    this.#bar.update(this.inspection, this.link, now, this.time.clock.atMs);
    this.#finish.update(this.inspection.facts.state);
    const linked = ['live', 'reconnecting'].includes(this.link.state) || !this.time.live;
    const robots = robotViews(this.time.shown, now, linked);
    if (this.#view) this.#view.linked = linked;
    this.strip.update(robots);
    const hearing = robots.map((robot) => robot.hearing).join();
    if (hearing !== this.#hearing) this.#view?.repaint();
    this.#hearing = hearing;
    this.alarms.update(this.time.live, this.#serverMs);
    this.#health.update(this.#pulse, this.time.shown, this.#view?.looks ?? null);
    this.#legend.update(this.#view?.raw ?? null, this.time.live ? undefined : this.#view?.past ?? null, this.time.hasReadings);
    setAttribute(this.#main, 'data-link', this.link.state);
    this.#wait.hidden = this.inspection.revision !== null; // that nothing is known yet is not that nothing was observed
    setAttribute(this.#main, 'data-loading', this.#wait.hidden ? null : '');
    setAttribute(this.#main, 'data-mode', this.time.mode);
    if (this.link.state === 'disconnected') {
      const ageMs = this.inspection.ageMs(now);
      const asOf = ageMs === null ? 'Nothing was received yet.' : `The picture is ${format.age(ageMs / 1000)} old.`;
      this.#say('DISCONNECTED', `${asOf} Server last heard ${format.age(this.link.silenceMs / 1000)} ago; trying again.`);
    } else if (this.link.state === 'refused') this.#say('NOT FOUND', 'The server has no such inspection.');
  }

  /** @param {string} loud @param {string} more */
  #say(loud, more) {
    setText(this.#banner.children[0], loud);
    setText(this.#banner.children[1], more);
  }

  /** @param {{xM: number, yM: number}} at */
  #point({ xM, yM }) {
    if (this.#view?.measure.distanceM) return; // the distance stays to be read
    const cell = this.#view?.looks?.at(xM, yM);
    const seen = cell?.looks ? `seen ${cell.looks} ×, ${format.age((this.time.shown.serverMs(Date.now()) - cell.newestMs) / 1000)} ago` : cell ? 'never seen' : 'outside';
    this.#cursor.hidden = false;
    setText(this.#cursor, `${format.place(xM, yM)}   ${seen}`);
  }

  /** @param {PondView} view */
  #measured({ measure }) {
    document.getElementById('measure')?.setAttribute('aria-pressed', String(measure.active));
    const words = measure.distanceM === null ? 'Measure: two points, by click or P' : `Distance ${format.length(measure.distanceM)}`;
    if (!measure.active) return;
    this.#cursor.hidden = false;
    setText(this.#cursor, words);
  }

  /** @param {string} id */
  #find(id) {
    const rod = this.#view?.pond.rods?.find((one) => one.id.toLowerCase() === id.toLowerCase());
    if (!rod || !this.#view) return false;
    this.tables.toggle(false);
    this.#chooseRod(rod);
    this.#view.map.reveal(rod.x_m, rod.y_m);
    return true;
  }

  /** @param {RodLayout | null} rod */
  #chooseRod(rod) {
    if (!this.#view || this.#view.chosenRod === rod) return;
    this.#view.chosenRod = rod;
    this.#wanted.rod = null;
    this.#view.evidence = null;
    this.#address.keep();
    if (rod) void this.rodPanel.open(this.time.shown.rod(rod.id), rod);
    else if (this.rodPanel.rodId) this.rodPanel.close();
    this.#view.repaint();
  }

  #showEvidence() {
    if (!this.#view) return;
    this.#view.evidence = this.rodPanel.chosen;
    this.#view.repaint();
  }

  #close() {
    if (this.alarms.close()) return;
    if (!this.tables.element.hidden) this.tables.toggle(false);
    else if (this.rodPanel.rodId) this.rodPanel.close();
    else if (this.#view) {
      this.#view.pointed = this.#view.finding = null;
      this.#view.repaint();
    }
  }

  #goNext() {
    const next = this.#view?.looks?.next;
    if (!next || !this.#view) return;
    this.#view.pointed = next;
    this.#view.map.goTo(next.xM, next.yM);
    this.#view.repaint();
  }

  /** @param {import('../state/robots.js').RobotView} robot */
  #goToRobot({ pose }) {
    if (pose.x_m !== null && pose.y_m !== null) this.#view?.map.goTo(pose.x_m, pose.y_m);
  }

  /** @param {Note} note */
  #goToNote({ rod_id: rod, x_m, y_m, moment }) {
    if (rod) this.#find(rod);
    else if (x_m !== null && y_m !== null) this.#view?.map.goTo(x_m, y_m);
    else if (moment) this.time.clock.seek(Date.parse(moment));
  }

  /** @param {import('../state/alarms.js').Alarm} alarm */
  #goToAlarm({ kind, subject }) {
    const robot = robotViews(this.time.shown, Date.now()).find(({ name }) => name === subject);
    if (kind.startsWith('rod-')) this.#find(subject);
    else if (robot) this.#goToRobot(robot);
    else if (kind === 'coverage-stale') this.#goNext();
  }

  #addressOf() {
    const rod = this.#view?.chosenRod?.id ?? this.#wanted.rod;
    const view = this.#view ? this.#view.map.view : this.#wanted.view;
    const at = this.time.clock.atMs ?? this.#wanted.at;
    return addressOf({ session: this.inspection.facts.id, rod, show: this.options.words(), view, at });
  }
}
