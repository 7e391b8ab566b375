// @ts-check
/** What can be done in the live view, each with its key: the list is what the page listens to, and what the help shows. */

import { toggleTheme } from './theme.js';

/** @typedef {import('./help.js').Action} Action */
/** @typedef {{goNext: () => void, close: () => void, help: () => void, note: () => void}} Uses */

const FADE = 0.1;

/** @param {import('./live.js').Live} live @param {Uses} uses @returns {Action[]} in groups, for the help */
export function actionsOf(live, uses) {
  return [...mapActions(live, uses), ...timeActions(live), ...pageActions(live, uses), ...live.alarms.actions.map((action) => ({ ...action, group: 'Alarms' }))];
}

/** @param {import('./live.js').Live} live @param {Uses} uses @returns {Action[]} */
function mapActions(live, { goNext }) {
  const { options } = live;
  const fade = (/** @type {number} */ by) => options.fade('layer', options.opacity.layer + by);
  const map = (/** @type {(view: import('./pondview.js').PondView) => void} */ run) => () => { if (live.view) run(live.view); };
  return [
    { keys: ['c'], word: 'Raw or corrected poses', run: () => options.togglePicture() },
    { keys: ['l'], word: 'Next layer: looks, age, uncertainty', run: () => options.nextLayer() },
    { keys: ['['], word: 'See more through the layer', run: () => fade(-FADE) },
    { keys: [']'], word: 'See less through it', run: () => fade(FADE) },
    { keys: ['r'], word: 'Rods', run: () => options.toggle('rods') },
    { keys: ['b'], word: 'Robots', run: () => options.toggle('robots') },
    { keys: ['k'], word: 'Tracks of the robots', run: () => options.toggle('tracks') },
    { keys: ['g'], word: 'Grid of metres', run: () => options.toggle('grid') },
    { keys: ['m'], word: 'Measure: click two points, or P', run: map((view) => view.toggleMeasure()) },
    { keys: ['p'], word: 'Measure from or to the cross', run: map((view) => view.measureTo()) },
    { keys: ['+', '='], word: 'Closer', run: map((view) => view.map.zoom(1.5)) },
    { keys: ['-'], word: 'Farther', run: map((view) => view.map.zoom(1 / 1.5)) },
    { keys: ['0', 'f'], word: 'The whole pond', run: map((view) => view.map.fit()) },
    { keys: ['/'], word: 'Find a rod', run: () => document.getElementById('find')?.focus() },
    { keys: ['n'], word: 'Where to look next', run: goNext },
  ].map((action) => ({ ...action, group: 'Map' }));
}

/** @param {import('./live.js').Live} live @returns {Action[]} */
function timeActions({ time }) {
  return [
    { keys: [' '], word: 'Hold this moment; replay or pause', run: () => time.toggle() },
    { keys: [','], word: 'Back by 5 s', run: () => time.step(-5) },
    { keys: ['.'], word: 'On by 5 s', run: () => time.step(5) },
    { keys: ['v'], word: 'Back to live', run: () => time.clock.goLive() },
  ].map((action) => ({ ...action, group: 'Time' }));
}

/** @param {import('./live.js').Live} live @param {Uses} uses @returns {Action[]} */
function pageActions({ tables }, { close, help, note }) {
  return [
    { keys: ['d'], word: 'Tables', run: () => tables.toggle(Boolean(tables.element.hidden)) },
    { keys: ['h'], word: 'Write a note for the next shift', run: note },
    { keys: ['t'], word: 'Light or dark', run: toggleTheme },
    { keys: ['i'], word: 'All inspections', run: () => location.assign('/?inspections') },
    { keys: ['?'], word: 'These keys', run: help },
    { keys: ['Escape'], word: 'Close the panel or the tables', run: close },
  ].map((action) => ({ ...action, group: 'Page' }));
}
