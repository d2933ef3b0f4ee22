// The cut of a round tool by a plane, bent or straight: discs of its axis, less the same discs a line's width smaller.
import { length, minus, plus } from "./vectors.js";
/** @import { Triple } from "./grid.js" */
/** @import { Port } from "./port.js" */

/** @typedef {{ segments: [Triple, Triple][], radii: number[], margin: number }} ToolPose axes of the tool's parts from the tip on, LPS mm; margin: of clearance around them, mm */
/** @typedef {{ x: number, y: number, radius: number }} Disc CSS pixels */

const LINE_PX = 1.5;
const APART = 0.15; // of the radius, between two discs

/**
 * The discs that a plane cuts out of a tool's parts, grown by `more` mm.
 * @param {Port} port
 * @param {ToolPose} pose
 * @param {number} more
 * @returns {Disc[]}
 */
export function discsOf(port, { segments, radii }, more) {
  /** @type {Disc[]} */
  const discs = [];
  segments.forEach(([from, to], part) => {
    const radius = radii[part] + more;
    const ends = [port.project(from), port.project(to)];
    const [a, b] = ends.map(({ away }) => away);
    if (Math.min(a, b) > radius || Math.max(a, b) < -radius) return;
    const way = minus(to, from);
    const steps = Math.max(1, Math.ceil(length(way) / (radius * APART)));
    for (let step = 0; step <= steps; step += 1) {
      const { x, y, away } = port.project(plus(from, way, step / steps));
      const cut = Math.sqrt(Math.max(0, radius * radius - away * away)) / port.perPixel;
      const shown = x + cut > 0 && y + cut > 0 && x - cut < port.width && y - cut < port.height;
      if (cut > 0 && shown) discs.push({ x, y, radius: cut });
    }
  });
  return discs;
}

/**
 * Draw the tool and the ring of its margin.
 * @param {CanvasRenderingContext2D} context scaled to CSS pixels
 * @param {Port} port
 * @param {ToolPose} pose
 * @param {{ tool: string, ring: string }} colours
 */
export function drawTool(context, port, pose, colours) {
  outline(context, discsOf(port, pose, pose.margin), colours.ring);
  outline(context, discsOf(port, pose, 0), colours.tool);
}

/**
 * The outline of the union of discs; what they cover is cleared.
 * @param {CanvasRenderingContext2D} context
 * @param {Disc[]} discs
 * @param {string} colour
 */
export function outline(context, discs, colour) {
  context.fillStyle = colour;
  for (const [less, how] of /** @type {[number, GlobalCompositeOperation][]} */ ([[0, "source-over"], [LINE_PX, "destination-out"]])) {
    context.globalCompositeOperation = how;
    context.beginPath();
    for (const { x, y, radius } of discs) {
      const r = radius - less;
      if (r <= 0) continue;
      context.moveTo(x + r, y);
      context.arc(x, y, r, 0, 2 * Math.PI);
    }
    context.fill();
  }
}
