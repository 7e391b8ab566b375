// @ts-check
/** The live view: one inspection, its feed, its map and its panels. */

import { openFeed } from '../api/client.js';
import { Intake } from '../live/intake.js';
import { Link } from '../live/link.js';
import { decode } from '../map/raster.js';
import { format as addressOf } from '../state/address.js';
import * as format from '../state/format.js';
import { Inspection } from '../state/inspection.js';
import { robotViews } from '../state/robots.js';
import { h, setAttribute, setText } from './dom.js';
import { listen } from './keys.js';
import { PondView } from './pondview.js';
import { RobotStrip } from './robotstrip.js';
import { RodPanel } from './rodpanel.js';
import { Summary } from './summary.js';
import { toggleTheme } from './theme.js';
import { TopBar } from './topbar.js';

const CLOCK_MS = 250;

export class Live {
  #bar = new TopBar();
  #summary = new Summary();
  #mapBox = h('div', { class: 'map', id: 'map', tabindex: '0', role: 'application', 'aria-label': 'Map of the pond; arrow keys pan, plus and minus zoom' });
  #banner = h('div', { class: 'banner', role: 'alert' });
  #cursor = h('div', { class: 'cursor', text: 'x –   y –' });
  #area = h('div', { class: 'map-area' }, this.#mapBox, this.#banner, this.#cursor);
  /** @type {PondView | null} */ #view = null;
  /** @type {string | null} */ #rodWanted;
  #dirty = false;

  /** @param {SessionFacts} facts @param {string | null} rod one to open at once */
  constructor(facts, rod) {
    this.inspection = new Inspection(facts);
    this.#rodWanted = rod;
    this.strip = new RobotStrip((robot) => this.#goToRobot(robot));
    this.rodPanel = new RodPanel(facts.id);
    const side = h('aside', { class: 'side', 'aria-label': 'Overview' }, this.rodPanel.element, this.#summary.element);
    this.element = h('div', {}, this.#bar.element, h('main', { class: 'live' }, this.#area, side, this.strip.element));
    const later = (/** @type {() => void} */ run, /** @type {number} */ ms) => setTimeout(run, ms);
    const world = { open: (/** @type {number | null} */ since) => openFeed(facts.id, since), now: Date.now, later, random: Math.random };
    this.link = new Link(world, () => this.inspection.revision);
    this.intake = new Intake({
      decode,
      paint: (patch, image) => this.#paintPatch(patch, image),
      apply: (message) => this.inspection.apply(message, Date.now()),
      resync: () => this.link.restart(1000),
    });
  }

  get view() { return this.#view; }

  start() {
    this.link.addEventListener('frame', (event) => this.intake.push(/** @type {CustomEvent} */ (event).detail));
    this.link.addEventListener('state', () => this.#update());
    this.inspection.addEventListener('hello', () => this.#hello());
    this.inspection.addEventListener('session', () => this.#revision());
    this.rodPanel.addEventListener('choose', () => this.#showEvidence());
    this.rodPanel.addEventListener('close', () => this.#chooseRod(null));
    addEventListener('online', () => this.link.restart());
    listen({ t: toggleTheme, Escape: () => this.rodPanel.close(), '0': () => this.#view?.map.fit(), f: () => this.#view?.map.fit(),
      '+': () => this.#view?.map.zoom(1.5), '-': () => this.#view?.map.zoom(1 / 1.5), r: () => this.#toggle('rods'), b: () => this.#toggle('robots') });
    setInterval(() => this.#tick(), CLOCK_MS);
    this.#update();
    this.link.start();
  }

  #hello() {
    const { raster, facts, revision } = this.inspection;
    if (!raster) return;
    if (!this.#view) this.#makeView(raster, facts.pond ?? pondOf(raster));
    else if (revision === null) this.#view.mosaic.clear();
  }

  /** @param {Raster} raster @param {Pond} pond */
  #makeView(raster, pond) {
    const view = new PondView(this.#mapBox, this.inspection, raster, pond);
    view.addEventListener('choose', (event) => this.#chooseRod(/** @type {CustomEvent} */ (event).detail));
    view.addEventListener('pointer', (event) => {
      const { xM, yM } = /** @type {CustomEvent} */ (event).detail;
      setText(this.#cursor, format.place(xM, yM));
    });
    this.#view = view;
    this.#area.append(tools(view), h('div', { class: 'map-layers' }, ...this.#layerButtons()));
    const wanted = pond.rods?.find((rod) => rod.id === this.#rodWanted);
    if (wanted) this.#chooseRod(wanted);
  }

  #layerButtons() {
    return /** @type {const} */ (['rods', 'robots']).map((name) => h('button', { type: 'button', id: `layer-${name}`, 'aria-pressed': 'true',
      title: `${name === 'rods' ? 'Rods (R)' : 'Robots (B)'}`, text: name === 'rods' ? 'Rods' : 'Robots', onClick: () => this.#toggle(name) }));
  }

  /** @param {'rods' | 'robots'} name */
  #toggle(name) {
    if (!this.#view) return;
    this.#view.shows[name] = !this.#view.shows[name];
    document.getElementById(`layer-${name}`)?.setAttribute('aria-pressed', String(this.#view.shows[name]));
    this.#view.repaint();
  }

  /** @param {Patch} patch @param {CanvasImageSource} image */
  #paintPatch(patch, image) {
    if (patch.layer === 'mosaic') this.#view?.mosaic.paint(patch, image);
  }

  #revision() {
    if (this.inspection.revision !== null) this.#view?.painted.wait(this.inspection.revision);
    this.#view?.repaint();
    if (this.#dirty) return;
    this.#dirty = true;
    setTimeout(() => this.#update(), 100);
  }

  #update() {
    this.#dirty = false;
    this.#summary.update(this.inspection);
    const rod = this.#view?.chosenRod;
    if (rod) this.rodPanel.show(this.inspection.rod(rod.id), rod);
    this.#tick();
  }

  /** What changes with time alone. */
  #tick() {
    const now = Date.now();
    this.#bar.update(this.inspection, this.link, now);
    this.strip.update(robotViews(this.inspection, now));
    setAttribute(this.#area, 'data-link', this.link.state);
    if (this.link.state === 'disconnected') {
      const asOf = this.inspection.dataAt ? `The picture is ${format.age((now - this.inspection.dataAt) / 1000)} old.` : 'Nothing was received yet.';
      this.#say('DISCONNECTED', `${asOf} Server last heard ${format.age(this.link.silenceMs / 1000)} ago; trying again.`);
    } else if (this.link.state === 'refused') this.#say('NOT FOUND', 'The server has no such inspection.');
  }

  /** @param {string} loud @param {string} more */
  #say(loud, more) {
    if (!this.#banner.firstChild) this.#banner.append(h('strong'), h('span'));
    setText(/** @type {Element} */ (this.#banner.firstChild), loud);
    setText(/** @type {Element} */ (this.#banner.lastChild), more);
  }

  /** @param {RodLayout | null} rod */
  #chooseRod(rod) {
    if (!this.#view || this.#view.chosenRod === rod) return;
    this.#view.chosenRod = rod;
    this.#view.evidence = null;
    history.replaceState(null, '', addressOf({ session: this.inspection.facts.id, rod: rod?.id ?? null }));
    if (rod) void this.rodPanel.open(this.inspection.rod(rod.id), rod);
    else if (this.rodPanel.rodId) this.rodPanel.close();
    this.#view.repaint();
  }

  #showEvidence() {
    if (!this.#view) return;
    this.#view.evidence = this.rodPanel.chosen;
    this.#view.repaint();
  }

  /** @param {import('../state/robots.js').RobotView} robot */
  #goToRobot({ pose }) {
    if (pose.x_m !== null && pose.y_m !== null) this.#view?.map.goTo(pose.x_m, pose.y_m);
  }
}

/** The pond of a session that says nothing of one: its raster's extent. @param {Raster} raster @returns {Pond} */
function pondOf(raster) {
  return { width_m: raster.width_px * raster.metres_per_pixel, height_m: raster.height_px * raster.metres_per_pixel };
}

/** @param {PondView} view */
function tools(view) {
  const button = (/** @type {string} */ text, /** @type {string} */ title, /** @type {() => void} */ onClick) =>
    h('button', { type: 'button', title, 'aria-label': title, text, onClick });
  return h('div', { class: 'map-tools' }, button('+', 'Closer (+)', () => view.map.zoom(1.5)),
    button('−', 'Farther (-)', () => view.map.zoom(1 / 1.5)), button('⤢', 'Whole pond (0)', () => view.map.fit()));
}
