// @ts-check
/** Where robots went, and the pond's grid of metres. Pond metres in. */

import { figure } from '../state/format.js';

/** @typedef {import('./frame.js').Frame} Frame */

/**
 * A line a robot through its placed snapshots, in order; gaps where one was not placed.
 * @param {CanvasRenderingContext2D} context @param {Frame} frame @param {Iterable<PoseRow>} poses
 * @param {Record<string, string>} colours
 */
export function paintTracks(context, frame, poses, colours) {
  /** @type {Map<string, PoseRow[]>} */
  const tracks = new Map();
  for (const pose of poses) {
    const track = tracks.get(pose.robot);
    if (track) track.push(pose);
    else tracks.set(pose.robot, [pose]);
  }
  for (const [colour, width] of /** @type {const} */ ([['paper', 3.5], ['robot', 1.5]])) {
    context.strokeStyle = colours[colour];
    context.lineWidth = width * frame.dpr;
    context.lineJoin = 'round';
    context.beginPath();
    for (const track of tracks.values()) trace(context, frame, track.sort(inOrder));
    context.stroke();
  }
}

/** Lines at round metres. @param {CanvasRenderingContext2D} context @param {Frame} frame
 * @param {Pond} pond @param {Record<string, string>} colours */
export function paintGrid(context, frame, pond, colours) {
  const stepM = gridStep(frame.scale / frame.dpr);
  const [left, right, top, bottom] = [frame.x(0), frame.x(pond.width_m), frame.y(pond.height_m), frame.y(0)];
  context.strokeStyle = colours.ink;
  context.globalAlpha = 0.35;
  context.lineWidth = frame.dpr;
  context.beginPath();
  for (let xM = 0; xM <= pond.width_m + 1e-9; xM += stepM) line(context, frame.x(xM), top, frame.x(xM), bottom);
  for (let yM = 0; yM <= pond.height_m + 1e-9; yM += stepM) line(context, left, frame.y(yM), right, frame.y(yM));
  context.stroke();
  context.globalAlpha = 1;
}

/** What the grid's lines are at, over whatever lies there. @param {CanvasRenderingContext2D} context @param {import('./frame.js').Frame} frame
 * @param {Pond} pond @param {Record<string, string>} colours */
export function paintGridNames(context, frame, pond, colours) {
  const stepM = gridStep(frame.scale / frame.dpr);
  const [left, bottom] = [frame.x(0), frame.y(0)];
  context.font = `${11 * frame.dpr}px system-ui, sans-serif`;
  context.fillStyle = colours.ink;
  const digits = Math.max(0, -Math.floor(Math.log10(stepM)));
  context.textAlign = 'center';
  context.textBaseline = 'top';
  for (let xM = 0; xM <= pond.width_m + 1e-9; xM += stepM) context.fillText(figure(xM, digits, 'm'), frame.x(xM), bottom + 3 * frame.dpr);
  context.textAlign = 'left'; // inside the pond: beside it there are buttons
  context.textBaseline = 'bottom';
  context.lineWidth = 3 * frame.dpr;
  context.lineJoin = 'round';
  context.strokeStyle = colours.paper;
  for (let yM = stepM; yM <= pond.height_m + 1e-9; yM += stepM) {
    const at = /** @type {const} */ ([figure(yM, digits, 'm'), left + 4 * frame.dpr, frame.y(yM) - 2 * frame.dpr]);
    context.strokeText(...at);
    context.fillText(...at);
  }
}

/**
 * A distance with its ends, and a cross in the middle of the map, which Enter takes as a point.
 * @param {CanvasRenderingContext2D} context @param {Frame} frame @param {import('../state/measure.js').Measure} measure
 * @param {string} label @param {Record<string, string>} colours
 */
export function paintMeasure(context, frame, { points }, label, colours) {
  const [midX, midY, arm] = [frame.width / 2, frame.height / 2, 9 * frame.dpr];
  const ends = points.map(({ xM, yM }) => [frame.x(xM), frame.y(yM)]);
  for (const [colour, width] of /** @type {const} */ ([['paper', 4.5], ['choice', 2]])) {
    context.strokeStyle = colours[colour];
    context.lineWidth = width * frame.dpr;
    context.beginPath();
    line(context, midX - arm, midY, midX + arm, midY);
    line(context, midX, midY - arm, midX, midY + arm);
    if (ends.length === 2) line(context, ends[0][0], ends[0][1], ends[1][0], ends[1][1]);
    for (const [x, y] of ends) {
      context.moveTo(x + 5 * frame.dpr, y);
      context.arc(x, y, 5 * frame.dpr, 0, 2 * Math.PI);
    }
    context.stroke();
  }
  if (ends.length < 2) return;
  context.font = `600 ${14 * frame.dpr}px system-ui, sans-serif`;
  context.textAlign = 'center';
  context.textBaseline = 'bottom';
  const [x, y] = [(ends[0][0] + ends[1][0]) / 2, (ends[0][1] + ends[1][1]) / 2 - 7 * frame.dpr];
  context.lineJoin = 'round';
  context.lineWidth = 5 * frame.dpr;
  context.strokeStyle = colours.paper;
  context.strokeText(label, x, y);
  context.fillStyle = colours.choice;
  context.fillText(label, x, y);
}

/** The step of a grid: 1, 2 or 5 of a power of ten, at least 60 screen pixels. @param {number} pxPerM */
export function gridStep(pxPerM) {
  const least = 60 / pxPerM;
  const power = 10 ** Math.floor(Math.log10(least));
  return ([1, 2, 5, 10].find((factor) => factor * power >= least) ?? 10) * power;
}

/** @param {CanvasRenderingContext2D} context @param {Frame} frame @param {PoseRow[]} track */
function trace(context, frame, track) {
  let drawing = false;
  for (const { x_m, y_m } of track) {
    if (x_m === null || y_m === null) drawing = false;
    else if (drawing) context.lineTo(frame.x(x_m), frame.y(y_m));
    else {
      context.moveTo(frame.x(x_m), frame.y(y_m));
      drawing = true;
    }
  }
}

/** @param {PoseRow} a @param {PoseRow} b */
function inOrder(a, b) {
  return (a.boot ?? 0) - (b.boot ?? 0) || a.sequence - b.sequence;
}

/** @param {CanvasRenderingContext2D} context @param {number} x0 @param {number} y0 @param {number} x1 @param {number} y1 */
function line(context, x0, y0, x1, y1) {
  context.moveTo(x0, y0);
  context.lineTo(x1, y1);
}
