// Triangles of round bodies: a capsule, and a thin tube along a way.
import { length, minus } from "../slices/vectors.js";

/** @import { Triple } from "../slices/grid.js" */

/** @typedef {{ positions: Float32Array, normals: Float32Array, indices: Uint32Array }} RoundMesh */

const AROUND = 20; // vertices of a ring
const CAP = 6; // rings of a half ball
const SIDES = 6; // of a tube
const APART_MM = 0.25; // of the places of a tube: nearer ones are one

/**
 * A capsule whose axis is z from 0 to its length, mm.
 * @param {number} radius
 * @param {number} long
 * @returns {RoundMesh}
 */
export function capsule(radius, long) {
  /** @type {{ around: number, up: number, z: number }[]} share of the radius, of the normal's z, and where the ring's middle is */
  const rings = [];
  for (let step = 0; step <= CAP; step += 1) {
    const turn = (step / CAP - 1) * (Math.PI / 2);
    rings.push({ around: Math.cos(turn), up: Math.sin(turn), z: 0 });
  }
  for (const ring of [...rings].reverse()) rings.push({ around: ring.around, up: -ring.up, z: long });
  /** @type {number[]} */
  const positions = [];
  /** @type {number[]} */
  const normals = [];
  for (const { around, up, z } of rings) {
    for (let at = 0; at < AROUND; at += 1) {
      const turn = (2 * Math.PI * at) / AROUND;
      const normal = [around * Math.cos(turn), around * Math.sin(turn), up];
      normals.push(...normal);
      positions.push(radius * normal[0], radius * normal[1], z + radius * normal[2]);
    }
  }
  return meshOf(positions, normals, rings.length, AROUND);
}

/**
 * A tube about a way, mm; nothing where the way has no length.
 * @param {Triple[]} way
 * @param {number} radius
 * @returns {RoundMesh}
 */
export function tube(way, radius) {
  const places = thinned(way);
  /** @type {number[]} */
  const positions = [];
  /** @type {number[]} */
  const normals = [];
  places.forEach((place, index) => {
    const before = places[Math.max(index - 1, 0)], after = places[Math.min(index + 1, places.length - 1)];
    const chord = minus(after, before), along = length(chord) > 0 ? chord : minus(place, before); // none where the way turns round
    const [u, v] = across(along);
    for (let side = 0; side < SIDES; side += 1) {
      const turn = (2 * Math.PI * side) / SIDES, [c, s] = [Math.cos(turn), Math.sin(turn)];
      const normal = [0, 1, 2].map((axis) => c * u[axis] + s * v[axis]);
      normals.push(...normal);
      positions.push(...place.map((value, axis) => value + radius * normal[axis]));
    }
  });
  return meshOf(positions, normals, places.length, SIDES);
}

/** @param {Triple[]} way */
function thinned(way) {
  /** @type {Triple[]} */
  const places = [];
  for (const place of way) {
    const last = places.at(-1);
    if (!last || length(minus(place, last)) >= APART_MM) places.push(place);
  }
  return places.length > 1 ? places : [];
}

/**
 * Two unit vectors across a direction and each other.
 * @param {Triple} along
 * @returns {[Triple, Triple]}
 */
function across(along) {
  const size = length(along) || 1;
  const [x, y, z] = along.map((value) => value / size);
  const other = Math.abs(z) < 0.9 ? [y, -x, 0] : [0, z, -y]; // along × z, or × x
  const long = Math.hypot(...other);
  const u = /** @type {Triple} */ (other.map((value) => value / long));
  return [u, [y * u[2] - z * u[1], z * u[0] - x * u[2], x * u[1] - y * u[0]]];
}

/**
 * @param {number[]} positions
 * @param {number[]} normals
 * @param {number} rings
 * @param {number} around
 * @returns {RoundMesh}
 */
function meshOf(positions, normals, rings, around) {
  /** @type {number[]} */
  const indices = [];
  for (let ring = 0; ring + 1 < rings; ring += 1) {
    for (let at = 0; at < around; at += 1) {
      const [a, b] = [ring * around + at, ring * around + ((at + 1) % around)];
      indices.push(a, b, a + around, b, b + around, a + around);
    }
  }
  return { positions: new Float32Array(positions), normals: new Float32Array(normals), indices: new Uint32Array(indices) };
}
