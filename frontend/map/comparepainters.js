// @ts-check
/** Two mosaics in one picture, and marks on the rods that changed. Where a mosaic shows nothing there is the hatched floor. */

import { changeOf } from '../state/comparison.js';
import { paintFloor } from './painters.js';

/** @typedef {import('./frame.js').Frame} Frame */
/** @typedef {import('./tilemosaic.js').TileMosaic} TileMosaic */
/** @typedef {{pond: Pond, colours: Record<string, string>}} Ground */
/** @typedef {(context: CanvasRenderingContext2D) => void} Paint */

/** A canvas of its own, as large as the map's, for what is put together before it is shown. */
export class Sheet {
  #context = /** @type {CanvasRenderingContext2D} */ (document.createElement('canvas').getContext('2d'));

  /** Empty, and then painted. @param {Frame} frame @param {Paint} paint */
  fill(frame, paint) {
    const { canvas } = this.#context;
    if (canvas.width !== frame.width || canvas.height !== frame.height) [canvas.width, canvas.height] = [frame.width, frame.height];
    this.#context.globalCompositeOperation = 'source-over';
    this.#context.clearRect(0, 0, canvas.width, canvas.height);
    paint(this.#context);
    return this;
  }

  get canvas() { return this.#context.canvas; }

  /** @param {GlobalCompositeOperation} how @param {Sheet} other */
  blend(how, other) {
    this.#context.globalCompositeOperation = how;
    this.#context.drawImage(other.canvas, 0, 0);
  }

  /** White where there was black. */
  invert() {
    this.#context.globalCompositeOperation = 'difference';
    this.#context.fillStyle = '#fff';
    this.#context.fillRect(0, 0, this.canvas.width, this.canvas.height);
  }
}

/** One mosaic over the floor. @param {CanvasRenderingContext2D} context @param {Frame} frame @param {TileMosaic} mosaic @param {Ground} ground */
export function paintOne(context, frame, mosaic, { pond, colours }) {
  paintFloor(context, frame, pond, colours);
  mosaic.paint(context, frame, pond);
}

/** What lies right of the divider, and the divider itself. @param {CanvasRenderingContext2D} context @param {Frame} frame
 * @param {number} at 0 to 1 @param {Paint} paintRight @param {Record<string, string>} colours */
export function paintSwiped(context, frame, at, paintRight, colours) {
  const x = Math.round(at * frame.width);
  context.save();
  context.beginPath();
  context.rect(x, 0, frame.width - x, frame.height);
  context.clip();
  context.clearRect(x, 0, frame.width - x, frame.height);
  paintRight(context);
  context.restore();
  context.fillStyle = colours.paper;
  context.fillRect(x - 2.5 * frame.dpr, 0, 5 * frame.dpr, frame.height);
  context.fillStyle = colours.ink;
  context.fillRect(x - frame.dpr, 0, 2 * frame.dpr, frame.height);
}

/** By how much two pictures differ, dark on white; only where both were seen. @param {CanvasRenderingContext2D} context @param {Frame} frame
 * @param {[TileMosaic, TileMosaic]} mosaics @param {Ground} ground @param {[Sheet, Sheet, Sheet]} sheets */
export function paintDifference(context, frame, [base, later], { pond, colours }, [difference, before, after]) {
  paintFloor(context, frame, pond, colours);
  before.fill(frame, (on) => base.paint(on, frame, pond));
  after.fill(frame, (on) => later.paint(on, frame, pond));
  difference.fill(frame, (on) => on.drawImage(before.canvas, 0, 0));
  difference.blend('difference', after);
  difference.invert();
  difference.blend('destination-in', before);
  difference.blend('destination-in', after);
  context.drawImage(difference.canvas, 0, 0);
}

/** A badge on each rod that is listed: its shape says what became of it. @param {CanvasRenderingContext2D} context @param {Frame} frame
 * @param {RodChange[]} rods @param {(id: string) => RodLayout | undefined} layout @param {Record<string, string>} colours */
export function paintChanges(context, frame, rods, layout, colours) {
  for (const rod of [...rods].reverse()) {
    const radiusM = layout(rod.rod_id)?.outer_radius_m ?? 0;
    if (!frame.sees(rod.x_m, rod.y_m, radiusM)) continue;
    const claimed = rod.change !== 'not_comparable';
    const [x, y, radius] = [frame.x(rod.x_m), frame.y(rod.y_m), Math.max(radiusM * frame.scale, 5 * frame.dpr)];
    paintRing(context, x, y, radius, claimed ? [[6, colours.ink], [3.5, colours.warn]] : [[1.5, colours.ink]], frame.dpr, !claimed);
    if (claimed || radius > 16 * frame.dpr) paintBadge(context, x + radius * 0.72, y - radius * 0.72, changeOf(rod.change).mark, claimed, colours, frame.dpr);
  }
}

/** @param {CanvasRenderingContext2D} context @param {number} x @param {number} y @param {number} radius
 * @param {[number, string][]} strokes @param {number} dpr @param {boolean} dashed */
function paintRing(context, x, y, radius, strokes, dpr, dashed) {
  context.setLineDash(dashed ? [4 * dpr, 4 * dpr] : []);
  for (const [width, colour] of strokes) {
    context.lineWidth = width * dpr;
    context.strokeStyle = colour;
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.stroke();
  }
  context.setLineDash([]);
}

/** @param {CanvasRenderingContext2D} context @param {number} x @param {number} y @param {string} mark @param {boolean} loud
 * @param {Record<string, string>} colours @param {number} dpr */
function paintBadge(context, x, y, mark, loud, colours, dpr) {
  const half = 8 * dpr;
  context.fillStyle = loud ? colours.warn : colours.paper;
  context.strokeStyle = colours['warn-ink'] || colours.ink;
  context.lineWidth = 1.5 * dpr;
  context.beginPath();
  context.roundRect(x - half, y - half, 2 * half, 2 * half, 3 * dpr);
  context.fill();
  context.stroke();
  context.font = `700 ${11 * dpr}px system-ui, sans-serif`;
  context.textAlign = 'center';
  context.textBaseline = 'middle';
  context.fillStyle = loud ? colours['warn-ink'] : colours.ink;
  context.fillText(mark, x, y + dpr / 2);
}
