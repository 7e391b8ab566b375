// @ts-check
/** The frames of the live feed, read. Pure: no socket, no DOM. */

/** @typedef {{type: string, [field: string]: any}} Message */

export class BadFrame extends Error {}

/**
 * A frame as the server sent it: JSON text, or a patch (header length, 4 bytes big-endian; JSON header; image).
 * @param {string | ArrayBuffer} data
 * @returns {Message}
 */
export function parseFrame(data) {
  if (typeof data === 'string') return parseJson(data);
  if (data.byteLength < 4) throw new BadFrame('A binary frame shorter than the length of its header.');
  const end = 4 + new DataView(data).getUint32(0);
  if (end > data.byteLength) throw new BadFrame('A binary frame that ends within its header.');
  const header = parseJson(new TextDecoder().decode(new Uint8Array(data, 4, end - 4)));
  return { ...header, content: new Uint8Array(data, end) };
}

/** @param {string} text @returns {Message} */
function parseJson(text) {
  const message = JSON.parse(text);
  if (typeof message?.type !== 'string') throw new BadFrame('A frame without a type.');
  return message;
}
