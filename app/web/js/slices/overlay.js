// A second volume overlaid on the first: its source, its transform, its opacity.
import { inverse } from "./grid.js";
/** @import { Raster } from "./cut.js" */
/** @import { Triple } from "./grid.js" */
/** @import { Greys } from "./shade.js" */

/** @typedef {{ opacity: number, greys: Greys }} OverlayLook opacity: 0 to 1 */
/** @typedef {number[]} Transform 4×4 row by row, from the second volume's LPS to the first one's, mm */

export const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
export const FARTHEST_MM = 1e4; // of its shift
const RIGID = 1e-3; // what rotation and last row may be off

/**
 * The 16 numbers of typed words; no words mean that both have one frame. Throws with words for people.
 * @param {string} words
 * @returns {Transform}
 */
export function transformOf(words) {
  const parts = words.replace(/[[\],;]/gu, " ").replace(/−/gu, "-").trim().split(/\s+/u).filter(Boolean);
  if (!parts.length) return IDENTITY;
  const numbers = parts.map(Number);
  if (numbers.length !== 16 || !numbers.every(Number.isFinite)) throw new Error("A transform has 16 numbers, row by row: second volume to the first, LPS, mm.");
  for (let a = 0; a < 3; a += 1) {
    for (let b = 0; b < 3; b += 1) {
      const product = [0, 1, 2].reduce((sum, row) => sum + numbers[row * 4 + a] * numbers[row * 4 + b], 0);
      if (Math.abs(product - (a === b ? 1 : 0)) > RIGID) throw new Error("The transform must be rigid: a rotation without scale or shear, and a shift in mm.");
    }
  }
  const [a, b, c, , d, e, g, , h, i, j] = numbers;
  // A reflection is orthonormal too.
  if (a * (e * j - g * i) - b * (d * j - g * h) + c * (d * i - e * h) < 0) throw new Error("The transform mirrors the second volume: left would be drawn as right. Check its axes.");
  if ([3, 7, 11].some((at) => Math.abs(numbers[at]) > FARTHEST_MM)) throw new Error(`The transform shifts the second volume beyond ${FARTHEST_MM} mm; check the unit.`);
  if ([12, 13, 14].some((at) => Math.abs(numbers[at]) > RIGID) || Math.abs(numbers[15] - 1) > RIGID) throw new Error("The last row of the transform must be 0 0 0 1.");
  return numbers;
}

/**
 * The raster of a view as the second volume's own frame sees it.
 * @param {Raster} raster
 * @param {Transform} transform
 * @returns {Raster}
 */
export function seenFrom({ width, height, start, u, v }, transform) {
  const back = inverse([transform.slice(0, 3), transform.slice(4, 7), transform.slice(8, 11)]);
  const turned = (/** @type {Triple} */ way) => /** @type {Triple} */ (back.map((row) => row[0] * way[0] + row[1] * way[1] + row[2] * way[2]));
  return {
    width,
    height,
    start: turned([start[0] - transform[3], start[1] - transform[7], start[2] - transform[11]]),
    u: turned(u),
    v: turned(v),
  };
}

/**
 * Mix the second picture into the first, where the second volume reaches.
 * @param {Uint32Array} rgba of the first, changed
 * @param {Int16Array} hu of the second
 * @param {Uint32Array} table of the second
 * @param {number} opacity
 * @param {number} outside the value that no voxel has
 */
export function blend(rgba, hu, table, opacity, outside) {
  const share = Math.round(opacity * 256);
  for (let n = 0; n < hu.length; n += 1) {
    if (hu[n] === outside) continue;
    const [a, b] = [rgba[n], table[hu[n] & 0xffff]];
    const redBlue = ((a & 0xff00ff) * (256 - share) + (b & 0xff00ff) * share) >>> 8;
    const green = ((a & 0xff00) * (256 - share) + (b & 0xff00) * share) >>> 8;
    rgba[n] = (0xff000000 | (redBlue & 0xff00ff) | (green & 0xff00)) >>> 0;
  }
}
