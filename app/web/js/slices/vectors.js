// Places and directions as triples of numbers, LPS mm.
/** @import { Triple } from "./grid.js" */

/**
 * @param {Triple} a
 * @param {Triple} b
 */
export function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/**
 * @param {Triple} a
 * @param {Triple} b
 * @returns {Triple}
 */
export function minus(a, b) {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

/**
 * a + s · b
 * @param {Triple} a
 * @param {Triple} b
 * @param {number} s
 * @returns {Triple}
 */
export function plus(a, b, s = 1) {
  return [a[0] + b[0] * s, a[1] + b[1] * s, a[2] + b[2] * s];
}

/**
 * @param {Triple} a
 * @param {Triple} b
 * @returns {Triple}
 */
export function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

/** @param {Triple} a */
export function length(a) {
  return Math.hypot(a[0], a[1], a[2]);
}

/**
 * @param {Triple} a
 * @returns {Triple}
 */
export function unit(a) {
  const size = length(a);
  return [a[0] / size, a[1] / size, a[2] / size];
}
