// Where a plane cuts a plan's regions: protected structures and bone to be removed, out of their shapes.
import { cross, dot, minus, plus, unit } from "./vectors.js";
import { discsOf, outline } from "./tool-outline.js";
/** @import { DrawingView, RegionView } from "../types.js" */
/** @import { Triple } from "./grid.js" */
/** @import { Port } from "./port.js" */
/** @import { Disc } from "./tool-outline.js" */

/** @typedef {[number, number]} Spot CSS pixels */
/** @typedef {{ discs: Disc[], lines: Spot[][], approximate: boolean }} Cut discs: their union is the cut; lines: of its border */

const FAR_MM = 500; // half the length of the line that a half-space is drawn as
const DASHES = [4, 3];

/**
 * The cut of a shape, as zones and plans write it; of a kind that is drawn as a surface elsewhere there is none.
 * @param {Port} port
 * @param {Record<string, any>} shape LPS, mm
 * @returns {Cut}
 */
export function cutShape(port, shape) {
  const cut = { discs: /** @type {Disc[]} */ ([]), lines: /** @type {Spot[][]} */ ([]), approximate: false };
  const chain = (/** @type {Triple[]} */ points) => {
    const ends = points.length > 1 ? points : [points[0], points[0]];
    const segments = ends.slice(1).map((to, at) => /** @type {[Triple, Triple]} */ ([ends[at], to]));
    return discsOf(port, { segments, radii: segments.map(() => shape.radius), margin: 0 }, 0);
  };
  switch (shape.kind) {
    case "sphere": return { ...cut, discs: chain([shape.centre]) };
    case "patch": return { ...cut, discs: chain([shape.centre]), approximate: true }; // the part of a surface within it
    case "capsule": return { ...cut, discs: chain([shape.start, shape.end]) };
    case "capsules": return { ...cut, discs: chain(shape.points) };
    case "box": return { ...cut, lines: cutBox(port, shape.transform_box_to_patient.flat(), shape.half_size) };
    case "half_space": return { ...cut, lines: cutPlane(port, shape.point, shape.normal) };
    default: return cut;
  }
}

/**
 * The outline of a box, closed; nothing where the plane misses it.
 * @param {Port} port
 * @param {number[]} transform 4×4 row by row, box to patient
 * @param {Triple} half sizes
 * @returns {Spot[][]}
 */
function cutBox(port, transform, half) {
  const corners = Array.from(Array(8).keys(), (n) => {
    const own = half.map((size, axis) => ((n >> axis) & 1 ? size : -size));
    const place = [0, 1, 2].map((row) => transform[row * 4 + 3] + own.reduce((sum, value, axis) => sum + transform[row * 4 + axis] * value, 0));
    return port.project(/** @type {Triple} */ (place));
  });
  /** @type {Spot[]} */
  const spots = [];
  for (let n = 0; n < 8; n += 1) {
    for (const bit of [1, 2, 4]) {
      const [a, b] = [corners[n], corners[n | bit]];
      if (n & bit || (a.away >= 0) === (b.away >= 0)) continue;
      const part = a.away / (a.away - b.away);
      spots.push([a.x + (b.x - a.x) * part, a.y + (b.y - a.y) * part]);
    }
  }
  if (spots.length < 3) return [];
  const middle = [0, 1].map((axis) => spots.reduce((sum, spot) => sum + spot[axis], 0) / spots.length);
  const angle = (/** @type {Spot} */ [x, y]) => Math.atan2(y - middle[1], x - middle[0]);
  spots.sort((one, other) => angle(one) - angle(other)); // the cut of a box is convex
  return [[...spots, spots[0]]];
}

/**
 * The line in which two planes meet.
 * @param {Port} port
 * @param {Triple} point
 * @param {Triple} normal
 * @returns {Spot[][]}
 */
function cutPlane(port, point, normal) {
  const { n } = port.axes;
  const way = cross(n, normal);
  if (Math.hypot(...way) < 1e-6) return [];
  const inPlane = unit(cross(way, n)); // within the view, across the line
  const foot = plus(port.centre, inPlane, dot(minus(point, port.centre), normal) / dot(inPlane, normal));
  const along = unit(way);
  return [[foot, foot].map((place, end) => {
    const { x, y } = port.project(plus(place, along, end ? FAR_MM : -FAR_MM));
    return /** @type {Spot} */ ([x, y]);
  })];
}

/**
 * The chain that is being drawn, as far as its places are clicked.
 * @param {DrawingView | null | undefined} drawing
 * @returns {Pick<RegionView, "visible" | "shape" | "colour" | "purpose">[]}
 */
export function drawnNow(drawing) {
  if (!drawing?.places.length) return [];
  const { places: points, radius_mm: radius, colour, purpose } = drawing;
  return [{ visible: true, shape: { kind: "capsules", points, radius }, colour, purpose }];
}

/**
 * Draw the visible regions onto a canvas that is scaled to CSS pixels.
 * @param {CanvasRenderingContext2D} context
 * @param {Port} port
 * @param {Pick<RegionView, "visible" | "shape" | "colour" | "purpose">[]} regions
 */
export function drawRegions(context, port, regions) {
  for (const { visible, shape, colour, purpose } of regions) {
    if (!visible) continue;
    const { discs, lines, approximate } = cutShape(port, shape);
    outline(context, discs, colour);
    context.globalCompositeOperation = "source-over";
    context.strokeStyle = colour;
    context.lineWidth = 1.5;
    context.setLineDash(purpose === "remove" || approximate ? DASHES : []);
    for (const spots of lines) {
      context.beginPath();
      spots.forEach(([x, y], at) => (at ? context.lineTo(x, y) : context.moveTo(x, y)));
      context.stroke();
    }
    context.setLineDash([]);
  }
}
