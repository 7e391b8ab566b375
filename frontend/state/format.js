// @ts-check
/** Numbers as an operator reads them: with a unit, never more digits than are known. Pure. */

export const NONE = '–';

/** An age. @param {number | null | undefined} s */
export function age(s) {
  if (s == null || !Number.isFinite(s)) return NONE;
  if (s < 9.95) return `${Math.max(0, s).toFixed(1)} s`;
  if (s < 120) return `${Math.round(s)} s`;
  if (s < 7200) return `${Math.round(s / 60)} min`;
  if (s < 172_800) return `${Math.round(s / 3600)} h`;
  return `${Math.round(s / 86_400)} days`;
}

/** A delay. @param {number | null | undefined} ms */
export function delay(ms) {
  if (ms == null || !Number.isFinite(ms)) return NONE;
  return ms < 1000 ? `${Math.round(ms)} ms` : age(ms / 1000);
}

/** A share from 0 to 1. @param {number | null | undefined} value @param {number} [digits] */
export function percent(value, digits = 0) {
  if (value == null || !Number.isFinite(value)) return NONE;
  const rounded = (value * 100).toFixed(digits);
  if (value < 1 && Number(rounded) === 100) return '> 99 %'; // almost all is not all
  return `${rounded} %`;
}

/** A length. @param {number | null | undefined} m */
export function length(m) {
  if (m == null || !Number.isFinite(m)) return NONE;
  const size = Math.abs(m);
  if (size > 0 && size < 0.000005) return '< 0.01 mm';
  if (size < 0.001) return `${(m * 1000).toFixed(2)} mm`;
  if (size < 0.01) return `${(m * 1000).toFixed(1)} mm`;
  if (size < 1) return `${(m * 100).toFixed(1)} cm`;
  return `${m.toFixed(2)} m`;
}

/** A place in the pond. @param {number} xM @param {number} yM */
export function place(xM, yM) {
  return `x ${xM.toFixed(3)} m   y ${yM.toFixed(3)} m`;
}

/** An angle, degrees. @param {number | null | undefined} rad */
export function angle(rad) {
  if (rad == null || !Number.isFinite(rad)) return NONE;
  return `${((rad * 180) / Math.PI).toFixed(1)}°`;
}

/** A count. @param {number | null | undefined} n */
export function count(n) {
  return n == null || !Number.isFinite(n) ? NONE : n.toLocaleString('en').replaceAll(',', '\u202f');
}

/** A moment, with its seconds and its zone: UTC everywhere, as in reports and logs. @param {string | number | null | undefined} at */
export function moment(at) {
  const date = new Date(at ?? NaN);
  if (Number.isNaN(date.getTime())) return NONE;
  return `${date.toISOString().slice(0, 19).replace('T', ' ')} UTC`;
}
