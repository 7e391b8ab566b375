// @ts-check
/** A layout from a file (CSV or JSON) or from an earlier inspection: for a new pond, or as a further version of one. */

import { listSessions } from '../api/client.js';
import { importLayout, pondPath, takeLayout } from '../api/ponds.js';
import { h } from './dom.js';
import { fileOf, formOf, labelled } from './pagekit.js';

/** @param {PondFacts | null} pond null: a new one @param {(made: PondFacts) => void} done */
export function layoutForm(pond, done) {
  const name = h('input', { id: 'pond-name', required: true, maxlength: '200' });
  const file = h('input', { id: 'layout-file', type: 'file', accept: '.csv,.json,text/csv,application/json' });
  const earlier = h('select', { id: 'layout-session' }, h('option', { value: '', text: 'none: from the file' }));
  const sides = [side('width_m', 'Width of the pond, m', pond?.layout.width_m), side('height_m', 'Height of the pond, m', pond?.layout.height_m)];
  const path = pond ? `${pondPath(pond.id)}/layouts` : '/api/ponds';
  const send = async () => {
    /** @type {Record<string, string>} */
    const query = pond ? {} : { name: name.value.trim() };
    if (earlier.value) return done(await takeLayout(path, { ...query, session: earlier.value }));
    for (const input of sides) if (input.value) query[input.name] = input.value;
    done(await importLayout(path, fileOf(file), query));
  };
  const form = formOf({ id: 'layout-form', word: pond ? 'Keep as a further version' : 'Make the pond', send }, ...(pond ? [] : [labelled('Name', name)]),
    labelled('File: CSV with id, x_m, y_m, outer_radius_m, inner_radius_m; or JSON as pond of a session.json', file),
    h('div', { class: 'two' }, ...sides.map((input) => labelled(`${input.title}; only needed with a CSV`, input))), labelled('Or as in an earlier inspection', earlier));
  const fold = h('details', { id: 'layout' }, h('summary', { text: pond ? 'Import a layout as a further version' : 'Make a pond from a layout' }), form);
  fold.addEventListener('toggle', () => { if (fold.open && earlier.options.length === 1) void offer(earlier); });
  return fold;
}

/** @param {HTMLSelectElement} earlier */
async function offer(earlier) {
  earlier.append(...(await listSessions()).map(({ id, name }) => h('option', { value: id, text: name || id })));
}

/** @param {string} name @param {string} title @param {number | undefined} value */
function side(name, title, value) {
  return h('input', { name, title, type: 'number', min: '0.001', max: '1000', step: 'any', value });
}
