// @ts-check
/** What the map shows, one function a thing, drawn in this order: floor, mosaic, rods, robots. Pond metres in. */

import { footprint } from './frame.js';
import { spots } from './labels.js';

/** @typedef {import('./frame.js').Frame} Frame */
/** @typedef {import('./raster.js').RasterCanvas} RasterCanvas */
/** @typedef {import('../state/robots.js').RobotView} RobotView */
/** @typedef {Record<string, string>} Colours */

const NEAREST_FROM = 2; // screen pixels a raster pixel, from which single pixels are shown as they are
const BADGE_PX = 11; // a symbol's radius where rods are large enough to carry it at their rim
const BADGE_FROM_PX = 19;
const LEGIBLE_PX = 7.5; // a symbol's radius from which its letter is read: taken where the rod is large enough for it

/** The pond's floor where nothing was seen: hatched, never a made-up picture.
 * @param {CanvasRenderingContext2D} context @param {Frame} frame @param {Pond} pond @param {Colours} colours */
export function paintFloor(context, frame, pond, colours) {
  const [x, y] = [frame.x(0), frame.y(pond.height_m)];
  const [width, height] = [pond.width_m * frame.scale, pond.height_m * frame.scale];
  context.fillStyle = colours.floor;
  context.fillRect(x, y, width, height);
  context.save();
  context.beginPath();
  context.rect(x, y, width, height);
  context.clip();
  context.strokeStyle = colours.hatch;
  context.lineWidth = frame.dpr;
  context.beginPath();
  const step = 12 * frame.dpr;
  const [left, right] = [Math.max(0, x), Math.min(frame.width, x + width)];
  for (let at = Math.floor((left - frame.height) / step) * step; at < right; at += step) {
    context.moveTo(at, frame.height);
    context.lineTo(at + frame.height, 0);
  }
  context.stroke();
  context.restore();
  context.strokeStyle = colours.edge;
  context.lineWidth = 2 * frame.dpr;
  context.strokeRect(x, y, width, height);
}

/** @param {CanvasRenderingContext2D} context @param {Frame} frame @param {RasterCanvas} mosaic @param {Pond} pond */
export function paintMosaic(context, frame, mosaic, pond) {
  const size = mosaic.raster.metres_per_pixel * frame.scale;
  context.imageSmoothingEnabled = size < NEAREST_FROM;
  const { canvas, factor } = mosaic.copyFor(size);
  const scale = size * factor;
  context.drawImage(canvas, frame.x(0), frame.y(pond.height_m), canvas.width * scale, canvas.height * scale);
}

/**
 * A symbol on each rod; on large ones at the rim, so that the picture of the rod itself stays in sight.
 * @param {CanvasRenderingContext2D} context @param {Frame} frame @param {RodLayout[]} rods
 * @param {(id: string) => RodRow} row @param {import('./symbols.js').Symbols} symbols @param {number} opacity 0 to 1
 */
export function paintRods(context, frame, rods, row, symbols, opacity) {
  context.globalAlpha = opacity;
  for (const rod of rods) {
    if (!frame.sees(rod.x_m, rod.y_m, rod.outer_radius_m)) continue;
    const outer = rod.outer_radius_m * frame.scale;
    const atRim = outer >= BADGE_FROM_PX * frame.dpr;
    const offset = atRim ? outer * 0.62 : 0;
    const picture = symbols.of(row(rod.id), atRim ? BADGE_PX * frame.dpr : radiusOf(rod, frame));
    const [x, y] = [frame.x(rod.x_m) + offset, frame.y(rod.y_m) + offset];
    context.drawImage(picture, Math.round(x - picture.width / 2), Math.round(y - picture.height / 2));
  }
  context.globalAlpha = 1;
}

/** Device px. @param {RodLayout} rod @param {Frame} frame */
function radiusOf({ inner_radius_m: innerM, outer_radius_m: outerM }, { scale, dpr }) {
  return Math.max(innerM * scale * 0.85, Math.min(outerM * scale * 0.9, LEGIBLE_PX * dpr));
}

/** A ring round the rod, or whatever else is a circle, that is chosen. @param {CanvasRenderingContext2D} context @param {Frame} frame
 * @param {RodPlace} rod @param {Colours} colours */
export function paintChosen(context, frame, rod, colours) {
  const radius = Math.max(rod.outer_radius_m * frame.scale, 8 * frame.dpr) + 2 * frame.dpr;
  for (const [width, colour] of /** @type {const} */ ([[5, colours.paper], [2.5, colours.choice]])) {
    context.lineWidth = width * frame.dpr;
    context.strokeStyle = colour;
    context.beginPath();
    context.arc(frame.x(rod.x_m), frame.y(rod.y_m), radius, 0, 2 * Math.PI);
    context.stroke();
  }
}

/** @param {CanvasRenderingContext2D} context @param {Frame} frame @param {PlanePose} pose @param {Camera} camera
 * @param {string} colour @param {{dash?: number[], width?: number, paper?: string}} [look] */
export function paintOutline(context, frame, pose, camera, colour, { dash = [], width = 2, paper } = {}) {
  context.beginPath();
  for (const [xM, yM] of footprint(pose, camera)) context.lineTo(frame.x(xM), frame.y(yM));
  context.closePath();
  if (paper) stroke(context, paper, (width + 2) * frame.dpr);
  context.setLineDash(dash.map((length) => length * frame.dpr));
  stroke(context, colour, width * frame.dpr);
  context.setLineDash([]);
}

/** Outlines and headings first, so that no name lies under one. @param {CanvasRenderingContext2D} context
 * @param {Frame} frame @param {RobotView[]} robots @param {Camera | undefined} camera @param {Colours} colours */
export function paintRobots(context, frame, robots, camera, colours) {
  const seen = [];
  for (const { name, pose, hearing } of robots) {
    if (pose.x_m === null || pose.y_m === null || pose.theta_rad === null) continue;
    const at = { x_m: pose.x_m, y_m: pose.y_m, theta_rad: pose.theta_rad };
    const colour = hearing === 'silent' ? colours.alarm : colours.robot;
    const dash = pose.status === 'placed' ? [] : [6, 4];
    if (camera) paintOutline(context, frame, at, camera, colour, { dash, width: 1.5, paper: colours.paper });
    paintHeading(context, frame, at, colour, colours.paper);
    seen.push({ at, colour, label: hearing === 'silent' ? `${name} silent` : name });
  }
  paintNames(context, frame, seen, colours.paper);
}

/** An arrow head along the image's u axis. @param {CanvasRenderingContext2D} context @param {Frame} frame
 * @param {PlanePose} pose @param {string} colour @param {string} paper */
function paintHeading(context, frame, pose, colour, paper) {
  context.save();
  context.translate(frame.x(pose.x_m), frame.y(pose.y_m));
  context.rotate(-pose.theta_rad);
  context.scale(frame.dpr, frame.dpr);
  context.beginPath();
  for (const [x, y] of [[11, 0], [-7, 7], [-3, 0], [-7, -7]]) context.lineTo(x, y);
  context.closePath();
  stroke(context, paper, 4);
  context.fillStyle = colour;
  context.fill();
  context.restore();
}

/** @param {CanvasRenderingContext2D} context @param {Frame} frame
 * @param {{at: PlanePose, colour: string, label: string}[]} robots @param {string} paper */
function paintNames(context, frame, robots, paper) {
  context.font = `600 ${12 * frame.dpr}px system-ui, sans-serif`;
  context.textBaseline = 'middle';
  context.textAlign = 'left';
  context.lineJoin = 'round';
  context.lineWidth = 4 * frame.dpr;
  context.strokeStyle = paper;
  const named = robots.map(({ at, label }) => ({ x: frame.x(at.x_m), y: frame.y(at.y_m), width: context.measureText(label).width }));
  const size = { height: 15 * frame.dpr, aside: 13 * frame.dpr, above: 11 * frame.dpr, across: frame.width };
  spots(named, size).forEach(({ x, y }, n) => {
    context.strokeText(robots[n].label, x, y);
    context.fillStyle = robots[n].colour;
    context.fillText(robots[n].label, x, y);
  });
}

/** @param {CanvasRenderingContext2D} context @param {string} colour @param {number} width */
function stroke(context, colour, width) {
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.stroke();
}

/** Where open notes of a place are. @param {CanvasRenderingContext2D} context @param {Frame} frame @param {Iterable<Note>} notes @param {Colours} colours */
export function paintNotes(context, frame, notes, colours) {
  const size = 16 * frame.dpr;
  context.font = `700 ${11 * frame.dpr}px system-ui, sans-serif`;
  context.textAlign = 'center';
  context.textBaseline = 'middle';
  context.lineWidth = 1.5 * frame.dpr;
  for (const { x_m, y_m, closed_at: closed } of notes) {
    if (x_m === null || y_m === null || closed) continue;
    const [x, y] = [frame.x(x_m), frame.y(y_m)];
    context.fillStyle = colours.paper;
    context.strokeStyle = colours.ink;
    context.fillRect(x - size / 2, y - size / 2, size, size);
    context.strokeRect(x - size / 2, y - size / 2, size, size);
    context.fillStyle = colours.ink;
    context.fillText('N', x, y);
  }
}

/** Where the next look would help most. @param {CanvasRenderingContext2D} context @param {Frame} frame
 * @param {{xM: number, yM: number}} place @param {Camera} camera @param {Colours} colours */
export function paintNext(context, frame, { xM, yM }, camera, colours) {
  const pose = { x_m: xM, y_m: yM, theta_rad: 0 };
  paintOutline(context, frame, pose, camera, colours.choice, { dash: [3, 5], width: 3, paper: colours.paper });
}
