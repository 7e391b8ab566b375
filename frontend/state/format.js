// @ts-check
/** Numbers as an operator reads them: with a unit, never more digits than are known. Pure. */

export const NONE = '–';
const UNBROKEN = '\u00a0';

/** A rounded number with a true minus, and none before what rounds to nothing. @param {number} value @param {number} [digits] */
export function fixed(value, digits = 0) {
  const text = Math.abs(value).toFixed(digits);
  return value < 0 && Number(text) !== 0 ? `−${text}` : text;
}

/** A figure and its unit, which stay on one line. @param {number} value @param {number} digits @param {string} unit */
export function figure(value, digits, unit) {
  return `${fixed(value, digits)}${UNBROKEN}${unit}`;
}

/** A sentence of the server: its figures keep their units and signs as those of the page do. @param {string} text */
export function sentence(text) {
  return text.replace(/(?<=\d) (?=(?:%|ms|s|min|h|px|mm|cm|m)(?!\w))|(?<=[<>±]) (?=\d)/g, UNBROKEN).replace(/(?<![\w-])-(?=\d)/g, '−');
}

/** An age. @param {number | null | undefined} s */
export function age(s) {
  if (s == null || !Number.isFinite(s)) return NONE;
  if (s < 9.95) return figure(Math.max(0, s), 1, 's');
  if (s < 120) return figure(s, 0, 's');
  if (s < 7200) return figure(s / 60, 0, 'min');
  if (s < 172_800) return figure(s / 3600, 0, 'h');
  return figure(s / 86_400, 0, 'days');
}

/** A delay. @param {number | null | undefined} ms */
export function delay(ms) {
  if (ms == null || !Number.isFinite(ms)) return NONE;
  return ms < 1000 ? figure(ms, 0, 'ms') : age(ms / 1000);
}

/** A share from 0 to 1. @param {number | null | undefined} value @param {number} [digits] */
export function percent(value, digits = 0) {
  if (value == null || !Number.isFinite(value)) return NONE;
  const rounded = (value * 100).toFixed(digits);
  if (value < 1 && Number(rounded) === 100) return `>${UNBROKEN}99${UNBROKEN}%`; // almost all is not all
  return `${rounded}${UNBROKEN}%`;
}

/** A length. @param {number | null | undefined} m */
export function length(m) {
  if (m == null || !Number.isFinite(m)) return NONE;
  const size = Math.abs(m);
  if (size > 0 && size < 0.000005) return `<${UNBROKEN}0.01${UNBROKEN}mm`;
  if (size < 0.001) return figure(m * 1000, 2, 'mm');
  if (size < 0.01) return figure(m * 1000, 1, 'mm');
  if (size < 1) return figure(m * 100, 1, 'cm');
  return figure(m, 2, 'm');
}

/** A place in the pond. @param {number} xM @param {number} yM @param {string} [between] */
export function place(xM, yM, between = '   ') {
  return `x${UNBROKEN}${figure(xM, 3, 'm')}${between}y${UNBROKEN}${figure(yM, 3, 'm')}`;
}

/** The same in few words. @param {number} xM @param {number} yM */
export function spot(xM, yM) {
  return `${fixed(xM, 2)},${UNBROKEN}${figure(yM, 2, 'm')}`;
}

/** An angle, degrees. @param {number | null | undefined} rad */
export function angle(rad) {
  if (rad == null || !Number.isFinite(rad)) return NONE;
  return `${fixed((rad * 180) / Math.PI, 1)}°`;
}

/** A count. @param {number | null | undefined} n */
export function count(n) {
  return n == null || !Number.isFinite(n) ? NONE : n.toLocaleString('en').replaceAll(',', '\u202f');
}

/** Of a moment the hour, its minutes and seconds, where the day is told elsewhere. @param {number} at epoch ms */
export function hour(at) { return moment(at).slice(11); }

/** A moment, with its seconds and its zone: UTC everywhere, as in reports and logs. @param {string | number | null | undefined} at */
export function moment(at) {
  const date = new Date(at ?? NaN);
  if (Number.isNaN(date.getTime())) return NONE;
  return `${date.toISOString().slice(0, 19).replace('T', ' ')} UTC`;
}
