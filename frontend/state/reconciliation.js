// @ts-check
/** What a reconciliation says, line by line; what a refused file is told; the page's address. Pure. */

/** In the order of importance. The mark says the outcome without its colour. */
export const OUTCOMES = /** @type {const} */ ([
  { outcome: 'disagree', word: 'Discrepancy', mark: '≠' }, { outcome: 'ambiguous', word: 'Ambiguous', mark: '?' },
  { outcome: 'not_observed', word: 'Not observed', mark: '–' }, { outcome: 'agree', word: 'Agree', mark: '=' },
]);
const EVERY = OUTCOMES.map(({ outcome }) => String(outcome));

/** @param {string} outcome */
export function outcomeOf(outcome) {
  return OUTCOMES.find((one) => one.outcome === outcome) ?? { outcome, word: outcome, mark: '' };
}

/** How many lines had an outcome, in words. @param {string} outcome @param {number} count */
export function counted(outcome, count) {
  const { word } = outcomeOf(outcome);
  return `${count} ${outcome === 'disagree' && count !== 1 ? 'discrepancies' : word.toLowerCase()}`;
}

export class ReconcileOptions extends EventTarget {
  session = '';
  /** `latest`: the last one imported for the pond. */ inventory = 'latest';
  /** The line that is looked at. @type {number | null} */ line = null;
  /** @type {Set<string>} */ only = new Set(EVERY);

  /** @param {Partial<ReconcileOptions>} change */
  set(change) {
    Object.assign(this, change);
    this.dispatchEvent(new Event('change'));
  }

  /** @param {string} outcome */
  toggleOnly(outcome) {
    const only = new Set(this.only);
    if (!only.delete(outcome)) only.add(outcome);
    this.set({ only });
  }

  get address() {
    const query = new URLSearchParams({ reconcile: this.session });
    if (this.inventory !== 'latest') query.set('inventory', this.inventory);
    if (this.only.size < EVERY.length) query.set('only', EVERY.filter((one) => this.only.has(one)).join(','));
    if (this.line !== null) query.set('line', String(this.line));
    return `/?${query.toString().replaceAll('%2C', ',')}`;
  }

  /** @param {string} search */
  read(search) {
    const query = new URLSearchParams(search);
    this.session = query.get('reconcile') ?? '';
    this.inventory = query.get('inventory') || 'latest';
    const only = query.get('only');
    if (only !== null) this.only = new Set(EVERY.filter((one) => only.split(',').includes(one)));
    const line = Number(query.get('line'));
    this.line = Number.isInteger(line) && line > 0 ? line : null;
    return this;
  }
}

/** The lines that are shown: what asks for somebody first, each kind in the file's order. @param {ReconciledLine[]} lines @param {Set<string>} only */
export function shown(lines, only) {
  const rank = (/** @type {ReconciledLine} */ { outcome }) => EVERY.indexOf(outcome);
  return lines.filter(({ outcome }) => only.has(outcome)).sort((a, b) => rank(a) - rank(b) || a.line - b.line);
}

/**
 * What is wrong with a refused file, line by line; the rest of what was said as it is.
 * @param {string} detail as the server says it: `line 3: …; line 5: …. Nothing was imported.`
 * @param {string} [numbers] the faulty lines: `3, 5`
 */
export function faultsOf(detail, numbers = '') {
  const known = numbers.split(',').map(Number).filter(Boolean);
  /** @type {{line: number, at: number}[]} */ const starts = [];
  let from = 0;
  for (const line of known) {
    const at = detail.indexOf(`line ${line}: `, from);
    if (at < 0) break;
    starts.push({ line, at });
    from = at + 1;
  }
  if (!starts.length) return { faults: [], rest: detail };
  const faults = starts.map(({ line, at }, i) => ({ line, fault: detail.slice(at + `line ${line}: `.length, starts[i + 1]?.at).replace(/;\s*$/, '') }));
  const last = faults[faults.length - 1];
  const [fault, ...rest] = last.fault.split(/(?:\. |; and )(?=\d+ more|Nothing was)/);
  last.fault = fault;
  return { faults, rest: rest.join('. ') };
}
