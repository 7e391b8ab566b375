// @ts-check
/** The `session.json` of an inspection to start, from a file, an earlier inspection, or both. Pure. */

/** @typedef {{[name: string]: unknown}} Layout */

/**
 * What a file says: a session.json, or a layout alone (an object with `width_m`, `height_m` and `rods`).
 * @param {string} text @param {string} name the file's @returns {Layout}
 */
export function readLayout(text, name) {
  let found;
  try {
    found = JSON.parse(text);
  } catch (error) {
    throw new Error(`${name} is not JSON: ${/** @type {Error} */ (error).message}`);
  }
  if (found === null || typeof found !== 'object' || Array.isArray(found)) throw new Error(`${name} holds no layout: it must be an object.`);
  if ('pond' in found) return found;
  if ('width_m' in found || 'rods' in found) return { pond: found };
  throw new Error(`${name} holds no layout: there is neither "pond" nor "width_m".`);
}

/**
 * What the file does not say comes from the earlier inspection.
 * @param {string} name @param {Layout | null} file @param {Layout | null} earlier
 */
export function documentOf(name, file, earlier) {
  if (!file && !earlier) throw new Error('Choose a layout: a file, or an earlier inspection.');
  /** @type {Layout} */
  const document = { format: 'pond-session/1', name };
  for (const part of ['camera', 'pond', 'pose_noise']) {
    const value = file?.[part] ?? earlier?.[part];
    if (value != null) document[part] = value;
  }
  if (!document.camera) throw new Error('The file says nothing of the camera: choose an earlier inspection to take it from.');
  return document;
}
