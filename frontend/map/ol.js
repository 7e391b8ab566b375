// @ts-check
/** The one place that knows how the map library gets into the page: a classic script, run before any module. */
export const library = globalThis.ol;
