// @ts-check
/** All ponds, and the making of another. */

import { listPonds } from '../api/ponds.js';
import * as format from '../state/format.js';
import { h } from './dom.js';
import { layoutForm } from './layoutform.js';
import { navigation } from './nav.js';
import { Fault, tableOf } from './pagekit.js';
import { TopBar } from './topbar.js';

export class PondsPage {
  #bar = new TopBar([navigation('ponds')]);
  #fault = new Fault();
  #list = h('div', { id: 'ponds' }, h('p', { class: 'quiet', text: 'Loading…' }));

  constructor() {
    this.#bar.title = 'Ponds';
    const form = layoutForm(null, ({ id }) => location.assign(`/?pond=${id}`));
    this.element = h('div', {}, this.#bar.element, h('main', { class: 'page' }, h('h2', { text: 'Ponds' }), form, this.#fault.element, this.#list));
  }

  get figures() { return {}; }

  async start() {
    await this.#fault.tell(async () => {
      const ponds = await listPonds();
      const rows = ponds.map(({ id, name, rods, layout_version: version, inspections, last, created_at: at }) => [h('a', { href: `/?pond=${id}`, text: name }), format.count(rods), `version ${version}`, format.count(inspections), format.moment(at),
        last ? h('span', { class: 'more-links' }, h('a', { href: `/?session=${last}`, text: 'Last inspection' }), (inspections ?? 0) > 1 ? h('a', { href: `/?compare=last,${last}`, text: 'Compare it' }) : '') : '']);
      this.#list.replaceChildren(rows.length ? tableOf(rows.length === 1 ? '1 pond' : `${rows.length} ponds, the newest first`, ['Pond', 'Rods', 'Layout', 'Inspections', 'Known since', ''], rows)
        : h('p', { class: 'note', text: 'There is no pond yet. The first inspection makes one, or a layout above.' }));
    });
  }
}
