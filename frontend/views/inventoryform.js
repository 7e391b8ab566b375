// @ts-check
/** Import of a declared inventory: checked whole; what is wrong is told line by line, and then nothing was imported. */

import { Problem } from '../api/client.js';
import { importInventory } from '../api/ponds.js';
import { faultsOf } from '../state/reconciliation.js';
import { h } from './dom.js';
import { Fault, fileOf, formOf, labelled } from './pagekit.js';

/** @param {() => string} pond @param {(made: Inventory) => void} done */
export function inventoryForm(pond, done) {
  const file = h('input', { id: 'inventory-file', type: 'file', accept: '.csv,text/csv' });
  const fault = new Fault();
  const send = async () => {
    const chosen = fileOf(file);
    try {
      done(await importInventory(pond(), chosen));
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      refuse(fault, chosen.name, error);
    }
  };
  const form = formOf({ id: 'inventory-form', word: 'Import', send, fault }, labelled('CSV with the columns item, position, state (empty, partial or full) and date (2026-01-31)', file));
  return h('details', { id: 'import' }, h('summary', { text: 'Import a declared inventory' }), form);
}

/** @param {Fault} fault @param {string} name @param {Problem} problem */
function refuse(fault, name, { message, facts }) {
  const { faults, rest } = faultsOf(message, String(facts.lines ?? ''));
  const count = Number(facts.faults ?? 0);
  const lines = faults.map((one) => h('li', {}, h('strong', { text: `Line ${one.line}` }), ` ${one.fault}`));
  fault.show(h('p', {}, h('strong', { text: count ? `${name} is refused: ${count} faulty ${count === 1 ? 'line' : 'lines'}.` : `${name} is refused.` }), ` ${rest}`), lines.length ? h('ul', { class: 'fault-lines' }, ...lines) : null);
}
