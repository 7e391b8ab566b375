// @ts-check
/** The alarms of an inspection as the server tells them: which ring, which are set aside, and what each asks for. Pure. */

export const FLOOD = 5;
export const ACTS = /** @type {const} */ (['acknowledge', 'shelve', 'unshelve', 'suppress', 'unsuppress', 'remove-from-service', 'return-to-service', 'reset']);

/** @typedef {typeof ACTS[number]} Act */
/**
 * @typedef {{
 *   id: number, kind: string, subject: string, title: string, severity: number, message: string, advice: string,
 *   active: boolean, acknowledged: boolean, latched: boolean, suppressed: boolean, out_of_service: boolean,
 *   retained: boolean, quiet: boolean, rings: boolean, shelved_until: string | null, since: string, occurrences: number,
 *   acts: Act[], comment: {at: string, by: string, act: string, text: string} | null,
 * }} Alarm
 */
/** @typedef {{kind: string, title: string, level: Level, alarms: Alarm[], ringing: number, flood: boolean}} Group */
/** @typedef {{name: 'high' | 'medium' | 'low', letter: string}} Level */

/** @type {Record<Act, string>} */
export const ACT_WORDS = {
  acknowledge: 'Acknowledge', shelve: 'Shelve', unshelve: 'Unshelve', suppress: 'Suppress', unsuppress: 'Lift suppression',
  'remove-from-service': 'Out of service', 'return-to-service': 'Back in service', reset: 'Reset',
};

/** Severities are 1 to 1000. @param {number} severity @returns {Level} */
export function levelOf(severity) {
  if (severity >= 800) return { name: 'high', letter: 'H' };
  return severity >= 500 ? { name: 'medium', letter: 'M' } : { name: 'low', letter: 'L' };
}

/** Where it stands, in words. @param {Alarm} alarm @param {(at: string) => string} clock */
export function stateWords({ active, acknowledged, latched, suppressed, out_of_service: out, shelved_until: until }, clock = (at) => at) {
  const words = [active ? 'active' : 'over', acknowledged ? 'acknowledged' : 'not acknowledged'];
  if (latched && !active) words.push('latched until it is reset');
  if (until) words.push(until === 'until-clear' ? 'shelved until it is over' : `shelved until ${clock(until)}`);
  if (suppressed) words.push('suppressed');
  if (out) words.push('out of service');
  return words.join(', ');
}

/** What it is about, in a few words. @param {Alarm} alarm */
export function nameOf({ title, subject }) {
  return subject ? `${title} · ${subject}` : title;
}

export class Alarms {
  /** @type {Map<number, Alarm>} */ #all = new Map();
  /** The server's, once it told them. @type {{robot_silent_s?: number, [name: string]: number | undefined}} */ limits = {};
  /** Grows with every change. */
  version = 0;

  /** @param {Alarm} alarm */
  apply(alarm) {
    if (alarm.retained || alarm.quiet) this.#all.set(alarm.id, alarm);
    else this.#all.delete(alarm.id);
    this.version += 1;
  }

  /** All come anew. */
  clear() {
    this.#all.clear();
    this.version += 1;
  }

  /** @param {number} id */
  get(id) { return this.#all.get(id); }

  /** Whether such an alarm is active, in sight or set aside. @param {string} kind @param {string} subject */
  isActive(kind, subject) { return [...this.#all.values()].some((alarm) => alarm.active && alarm.kind === kind && alarm.subject === subject); }

  /** How many ask for somebody. */
  get ringing() { return [...this.#all.values()].filter(({ rings }) => rings).length; }

  /** The worst that rings; null where none does. @type {Level | null} */
  get worst() {
    const severities = [...this.#all.values()].filter(({ rings }) => rings).map(({ severity }) => severity);
    return severities.length ? levelOf(Math.max(...severities)) : null;
  }

  /** In sight: those that ring first, then by severity, then the newest. @returns {Alarm[]} */
  get current() { return [...this.#all.values()].filter(({ retained, quiet }) => retained && !quiet).sort(worstFirst); }

  /** Shelved, suppressed or out of service. @returns {Alarm[]} */
  get aside() { return [...this.#all.values()].filter(({ quiet }) => quiet).sort(worstFirst); }

  /** What is in sight, by kind; a kind of more than FLOOD is told as one. @returns {Group[]} */
  get groups() {
    /** @type {Map<string, Alarm[]>} */
    const kinds = new Map();
    for (const alarm of this.current) kinds.set(alarm.kind, [...(kinds.get(alarm.kind) ?? []), alarm]);
    return [...kinds].map(([kind, alarms]) => ({
      kind, title: alarms[0].title, level: levelOf(alarms[0].severity), alarms,
      ringing: alarms.filter(({ rings }) => rings).length, flood: alarms.length > FLOOD,
    }));
  }
}

/** Those to which an act can be done now. @param {Iterable<Alarm>} alarms @param {Act} act */
export function open(alarms, act) {
  return [...alarms].filter(({ acts }) => acts.includes(act));
}

/** @param {Alarm} a @param {Alarm} b */
function worstFirst(a, b) {
  return Number(b.rings) - Number(a.rings) || b.severity - a.severity || b.since.localeCompare(a.since) || a.id - b.id;
}
