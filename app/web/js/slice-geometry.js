// A CT slice as a plane in the patient: from the patient's millimetres (LPS) to the picture's and back.
/** @import { ItemEntry, SliceGrid, SlicePlane } from "./types.js" */
/** @import { PlaceNear } from "./near-plane.js" */

/** @typedef {ItemEntry["position"]} Position LPS, mm */

/**
 * Width and height of a picture, mm.
 * @param {SliceGrid} grid
 */
export function sizeOf({ columns, rows, u, v }) {
  return { width: columns * length(u), height: rows * length(v) };
}

/**
 * Millimetres from the picture's upper left corner, and the signed distance from the plane.
 * @param {SlicePlane} plane
 * @param {number} normal index of the axis across the plane
 * @param {Position} point
 * @returns {PlaceNear}
 */
export function toPicture({ origin, u, v, position }, normal, point) {
  const delta = /** @type {Position} */ (point.map((value, index) => value - origin[index]));
  return {
    x: dot(delta, u) / length(u) + length(u) / 2,
    y: dot(delta, v) / length(v) + length(v) / 2,
    away: point[normal] - position,
  };
}

/**
 * The place in the patient of a place on the picture; null beside the picture.
 * @param {SliceGrid} grid
 * @param {number} x mm from the upper left corner
 * @param {number} y
 * @returns {Position | null}
 */
export function toPatient(grid, x, y) {
  const { width, height } = sizeOf(grid);
  if (x < 0 || y < 0 || x > width || y > height) return null;
  const { origin, u, v } = grid;
  const column = x / length(u) - 0.5; // the origin is the centre of the first pixel
  const row = y / length(v) - 0.5;
  return /** @type {Position} */ (origin.map((value, index) => value + u[index] * column + v[index] * row));
}

/**
 * @param {Position} a
 * @param {Position} b
 */
function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/** @param {Position} a */
function length(a) {
  return Math.hypot(...a);
}
