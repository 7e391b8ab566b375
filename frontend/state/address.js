// @ts-check
/** What the page shows, as its address: a view can be sent to a colleague. Pure. */

/** Where the map looks: its middle, m, pond frame, and metres a screen pixel. @typedef {{xM: number, yM: number, metresPerPx: number}} MapView */
/**
 * view: null where the whole pond is shown. at: the moment under review, epoch ms, the server's clock; null: live.
 * @typedef {{session: string | null, rod: string | null, home: boolean, show: string | null, view: MapView | null, at: number | null}} Address
 */

/** @param {string} search @returns {Address} */
export function parse(search) {
  const query = new URLSearchParams(search);
  const atMs = Date.parse(query.get('at') ?? '');
  return {
    session: query.get('session'), rod: query.get('rod'), home: query.has('inspections'), show: query.get('show'),
    view: readView(query.get('view')), at: Number.isNaN(atMs) ? null : atMs,
  };
}

/** @param {Partial<Address>} address @returns {string} */
export function format({ session, rod, home, show, view, at }) {
  const query = new URLSearchParams();
  if (session) query.set('session', session);
  if (session && rod) query.set('rod', rod);
  if (session && show) query.set('show', show);
  if (session && view) query.set('view', writeView(view));
  if (session && at != null) query.set('at', new Date(at).toISOString());
  if (home && !session) query.set('inspections', '');
  const text = query.toString().replace(/=(?=&|$)/g, '');
  return text ? `/?${text.replaceAll('%2C', ',').replaceAll('%3A', ':')}` : '/';
}

/** @param {MapView} view */
export function writeView({ xM, yM, metresPerPx }) {
  return [xM.toFixed(4), yM.toFixed(4), metresPerPx.toPrecision(4)].join(',');
}

/** What is no view is none. @param {string | null} text @returns {MapView | null} */
export function readView(text) {
  const [xM, yM, metresPerPx] = (text ?? '').split(',').map(Number);
  return text && [xM, yM, metresPerPx].every(Number.isFinite) && metresPerPx > 0 ? { xM, yM, metresPerPx } : null;
}
