// @ts-check
/** What the page shows, as its address: a view can be sent to a colleague. Pure but for `current` and `go`. */

/** @typedef {{session: string | null, rod: string | null, home: boolean, show: string | null}} Address */

/** @param {string} search @returns {Address} */
export function parse(search) {
  const query = new URLSearchParams(search);
  return { session: query.get('session'), rod: query.get('rod'), home: query.has('inspections'), show: query.get('show') };
}

/** @param {Partial<Address>} address @returns {string} */
export function format({ session, rod, home, show }) {
  const query = new URLSearchParams();
  if (session) query.set('session', session);
  if (session && rod) query.set('rod', rod);
  if (session && show) query.set('show', show);
  if (home && !session) query.set('inspections', '');
  const text = query.toString().replace(/=(?=&|$)/g, '');
  return text ? `/?${text.replaceAll('%2C', ',')}` : '/';
}
