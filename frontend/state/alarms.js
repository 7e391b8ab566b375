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
/** Whether it asks for somebody: active; returned to normal, and only to be acknowledged; answered. @typedef {'active' | 'returned' | 'answered'} Call */
/** @typedef {{kind: string, title: string, level: Level, call: Call, alarms: Alarm[], ringing: number, returned: number, flood: boolean}} Group */
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
  const words = [active ? 'active' : 'returned to normal', acknowledged ? 'acknowledged' : 'not acknowledged'];
  if (latched && !active) words.push('latched until it is reset');
  if (until) words.push(until === 'until-clear' ? 'shelved until it is over' : `shelved until ${clock(until)}`);
  if (suppressed) words.push('suppressed');
  if (out) words.push('out of service');
  return words.join(', ');
}

/** How it asks, in the terms of OPC UA Part 9: active or inactive, by acknowledged or not. @param {Pick<Alarm, 'active' | 'rings'>} alarm @returns {Call} */
export function callOf({ active, rings }) { return rings ? (active ? 'active' : 'returned') : 'answered'; }

/** What is wrong, or was. @param {Alarm} alarm */
export function messageOf({ active, message }) { return active ? message : `Was: ${message}`; }

/** What to do: of one that returned to normal only what takes it from the list. @param {Alarm} alarm @param {boolean} [early] whether poses have had no time to be decided */
export function adviceOf({ kind, active, acknowledged, latched, advice }, early = false) {
  if (active) return early && kind === 'correction-poor' ? `Wait: poses are still being decided. If it stays: ${advice}` : advice;
  const left = [!acknowledged && 'acknowledge it', latched && 'reset it'].filter(Boolean).join(', then ');
  return `${latched ? `${advice} ` : ''}Over${left ? `: ${left}` : ''}.`;
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
  /** Whether poses have had no time to be decided. */ early = false;

  /** @param {boolean} early */
  tell(early) {
    if (early === this.early) return;
    this.early = early;
    this.version += 1;
  }

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

  /** How many nobody acknowledged. */
  get ringing() { return [...this.#all.values()].filter(({ rings }) => rings).length; }

  /** How many call so. @param {Call} call */
  count(call) { return this.current.filter((alarm) => callOf(alarm) === call).length; }

  /** The worst that is active and not acknowledged; null where none is. @type {Level | null} */
  get worst() {
    const severities = [...this.#all.values()].filter((alarm) => callOf(alarm) === 'active').map(({ severity }) => severity);
    return severities.length ? levelOf(Math.max(...severities)) : null;
  }

  /** In sight: those that are active and not acknowledged first, then those not acknowledged, then by severity, then the newest. @returns {Alarm[]} */
  get current() { return [...this.#all.values()].filter(({ retained, quiet }) => retained && !quiet).sort(worstFirst); }

  /** Shelved, suppressed or out of service. @returns {Alarm[]} */
  get aside() { return [...this.#all.values()].filter(({ quiet }) => quiet).sort(worstFirst); }

  /** What is in sight, by kind; a kind of more than FLOOD is told as one. @returns {Group[]} */
  get groups() {
    /** @type {Map<string, Alarm[]>} */
    const kinds = new Map();
    for (const alarm of this.current) kinds.set(alarm.kind, [...(kinds.get(alarm.kind) ?? []), alarm]);
    return [...kinds].map(([kind, alarms]) => ({
      kind, title: alarms[0].title, level: levelOf(alarms[0].severity), call: callOf(alarms[0]), alarms,
      ringing: alarms.filter(({ rings }) => rings).length, returned: alarms.filter(({ active }) => !active).length, flood: alarms.length > FLOOD,
    }));
  }
}

/** Those to which an act can be done now. @param {Iterable<Alarm>} alarms @param {Act} act */
export function open(alarms, act) {
  return [...alarms].filter(({ acts }) => acts.includes(act));
}

const RANKS = { active: 2, returned: 1, answered: 0 };

/** @param {Alarm} a @param {Alarm} b */
function worstFirst(a, b) {
  return RANKS[callOf(b)] - RANKS[callOf(a)] || b.severity - a.severity || b.since.localeCompare(a.since) || a.id - b.id;
}
