// The lens of a scope: where it is, where it looks, and how places come into its round picture. Pure arithmetic, LPS mm.
import { cross, dot, minus, plus, unit } from "../slices/vectors.js";
/** @import { Triple } from "../slices/grid.js" */

/** What the shaft says: its tip, the way it points, and the side that a tilted lens looks to. @typedef {{ tip: Triple, shaft: Triple, side: Triple }} ScopePose */
/** angle: tilt of the lens. turn: of the lens about the shaft. level: keep the head upright. @typedef {{ angle: number, turn: number, level: boolean }} LensSettings in degrees */
/** right, above, ahead: of the picture. toClip: column by column, for WebGL. @typedef {{ eye: Triple, right: Triple, above: Triple, ahead: Triple, far: number, toClip: Float32Array }} Lens */

export const ANGLES = [0, 30, 45, 70];
export const FIELD = 70; // degrees across the round picture
export const NEAR = 0.1; // mm
export const FAR = 120;
/** @type {Triple} */
const UPWARDS = [0, 0, 1];
// Sines of the angle to the vertical: below the first the picture's up is the scope's own, from the second on the head's;
// in between it goes over from one to the other, or it would spin.
const [LOOSE, FIRM] = [0.12, 0.32];
const RADIANS = Math.PI / 180;

/**
 * @param {ScopePose} pose
 * @param {LensSettings} settings
 * @param {number} [far] mm beyond which nothing is in the picture
 * @returns {Lens}
 */
export function lensOf({ tip, shaft, side }, { angle, turn, level }, far = FAR) {
  const along = unit(shaft);
  const start = unit(plus(side, along, -dot(side, along)));
  const across = cross(along, start);
  const toSide = plus(scale(start, Math.cos(turn * RADIANS)), across, Math.sin(turn * RADIANS));
  const [c, s] = [Math.cos(angle * RADIANS), Math.sin(angle * RADIANS)];
  const ahead = plus(scale(along, c), toSide, s);
  const own = plus(scale(toSide, c), along, -s); // up in the picture, as the scope is turned
  const right = unit(cross(ahead, level ? levelled(ahead, own) : own));
  const above = cross(right, ahead);
  return { eye: tip, right, above, ahead, far, toClip: clipMatrix(tip, right, above, ahead, far) };
}

/**
 * The head's up in the picture, as far as the view is not along it.
 * @param {Triple} ahead
 * @param {Triple} own
 * @returns {Triple}
 */
function levelled(ahead, own) {
  const up = plus(UPWARDS, ahead, -dot(UPWARDS, ahead));
  const firm = Math.min(1, Math.max(0, (Math.hypot(...up) - LOOSE) / (FIRM - LOOSE)));
  return plus(scale(up, firm), own, 1 - firm);
}

/**
 * @param {Triple} eye
 * @param {Triple} right
 * @param {Triple} above
 * @param {Triple} ahead
 * @param {number} far
 */
function clipMatrix(eye, right, above, ahead, far) {
  const f = 1 / Math.tan((FIELD / 2) * RADIANS);
  const depth = (far + NEAR) / (far - NEAR);
  const rows = [scale(right, f), scale(above, f), scale(ahead, depth), ahead];
  const shifts = rows.map((row) => -dot(row, eye));
  shifts[2] -= (2 * far * NEAR) / (far - NEAR);
  return new Float32Array([0, 1, 2].flatMap((axis) => rows.map((row) => row[axis])).concat(shifts));
}

/**
 * Where a place is in the picture, from −1 to 1 to the right and up; null behind the lens.
 * @param {Lens} lens
 * @param {Triple} place
 * @returns {[number, number] | null}
 */
export function project({ eye, right, above, ahead }, place) {
  const from = minus(place, eye);
  const depth = dot(from, ahead);
  if (depth <= NEAR) return null;
  const f = 1 / Math.tan((FIELD / 2) * RADIANS);
  return [(f * dot(from, right)) / depth, (f * dot(from, above)) / depth];
}

/**
 * @param {Triple} way
 * @param {number} by
 * @returns {Triple}
 */
function scale(way, by) {
  return [way[0] * by, way[1] * by, way[2] * by];
}
