// @ts-check
/** Light or dark, kept in this browser; and the colours that the map paints with. */

const KEY = 'pondwatch-theme';

export function restoreTheme() {
  set(localStorage.getItem(KEY) === 'dark' ? 'dark' : 'light');
}

export function toggleTheme() {
  const theme = document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark';
  set(theme);
  localStorage.setItem(KEY, theme);
}

/** @param {string} theme */
function set(theme) {
  document.documentElement.dataset.theme = theme;
  document.dispatchEvent(new Event('themechange'));
}

/** The map's colours in this theme. */
export function mapColours() {
  const style = getComputedStyle(document.documentElement);
  const names = ['ground', 'floor', 'hatch', 'edge', 'paper', 'robot', 'alarm', 'choice', 'ink', 'warn', 'warn-ink', 'step-1', 'step-2', 'step-3', 'step-4', 'step-bad'];
  return Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

/** @returns {import('../map/symbols.js').Palette} */
export function rodPalette() {
  const style = getComputedStyle(document.documentElement);
  const names = ['full', 'partial', 'empty', 'unseen', 'conflicting', 'ink', 'paper', 'pale', 'blank'];
  const entries = names.map((name) => [name, style.getPropertyValue(`--rod-${name}`).trim()]);
  return /** @type {import('../map/symbols.js').Palette} */ (Object.fromEntries(entries));
}
