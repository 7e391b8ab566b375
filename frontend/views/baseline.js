// @ts-check
/** Which earlier inspection of the same pond this one is held against. */

import { Problem, listSessions, setBaseline } from '../api/client.js';
import { h, setText } from './dom.js';

export class Baseline {
  #facts;
  #choice = h('select', { id: 'baseline', onChange: () => void this.#set() });
  #fault = h('span', { role: 'alert' });
  element = h('div', { class: 'toolbar' }, h('label', { for: 'baseline', text: 'Rods are held against' }), this.#choice, this.#fault);

  /** @param {() => SessionFacts} facts */
  constructor(facts) {
    this.#facts = facts;
  }

  /** Look which there are. */
  async open() {
    const { id, pond, baseline } = this.#facts();
    try {
      const earlier = (await listSessions()).filter((one) => one.state === 'finished' && one.id < id && one.rods === pond?.rods?.length
        && one.pond?.width_m === pond?.width_m && one.pond?.height_m === pond?.height_m);
      const options = earlier.map((one) => h('option', { value: one.id, text: one.name || one.id }));
      if (baseline && !earlier.some((one) => one.id === baseline)) options.push(h('option', { value: baseline, text: baseline }));
      this.#choice.replaceChildren(h('option', { value: '', text: 'nothing: no rod is called changed' }), ...options);
      this.#choice.value = baseline ?? '';
      setText(this.#fault, '');
    } catch (error) {
      this.#say(error);
    }
  }

  async #set() {
    try {
      await setBaseline(this.#facts().id, this.#choice.value || null);
      setText(this.#fault, '');
    } catch (error) {
      this.#choice.value = this.#facts().baseline ?? '';
      this.#say(error);
    }
  }

  /** @param {unknown} error */
  #say(error) {
    if (!(error instanceof Problem)) throw error;
    setText(this.#fault, error.message);
  }
}
