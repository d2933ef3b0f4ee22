// Cuts a plane out of an int16 volume, trilinear between voxel centres, as the engine's `Volume.sample` does.
/** @import { Grid, Triple } from "./grid.js" */

export const OUTSIDE = -32768; // no voxel is there; the value itself is no Hounsfield unit of a scan
const EDGE = 1e-6; // [voxel] beyond the outermost centres, for rounding; the engine has the same
const INNER = -1e-9; // [voxel] so far within them, every index has a neighbour

/** @typedef {{ grid: Grid, voxels: Int16Array }} CutVolume voxels: i fastest, then j, then k */
/** @typedef {{ width: number, height: number, start: Triple, u: Triple, v: Triple }} Raster LPS mm: centre of the first pixel, and the ways to the next column and the next row */

/**
 * Write the HU of a raster; what the volume does not reach keeps its value.
 * @param {Int16Array} hu width × height values, row by row
 * @param {CutVolume} volume
 * @param {Raster} raster
 */
export function cutPlane(hu, volume, { width, height, start, u, v }) {
  const { grid } = volume;
  const first = grid.index(start);
  const column = grid.step(u);
  const row = grid.step(v);
  const last = /** @type {Triple} */ (grid.shape.map((count) => count - 1));
  for (let y = 0; y < height; y += 1) {
    const at = /** @type {Triple} */ (first.map((value, axis) => value + row[axis] * y));
    const [from, to] = covered(at, column, last, width, EDGE);
    const [innerFrom, innerTo] = covered(at, column, last, width, INNER);
    const edge = (/** @type {number} */ x) => atIndex(volume, at[0] + column[0] * x, at[1] + column[1] * x, at[2] + column[2] * x);
    const split = innerFrom < innerTo ? innerFrom : to;
    for (let x = from; x < split; x += 1) hu[y * width + x] = edge(x);
    cutRow(hu, volume, at, column, y * width, innerFrom, innerTo);
    for (let x = Math.max(innerTo, split); x < to; x += 1) hu[y * width + x] = edge(x);
  }
}

/**
 * The columns of a row whose voxels all have neighbours: nothing is asked within the loop.
 * @param {Int16Array} hu
 * @param {CutVolume} volume
 * @param {Triple} at index of the row's first pixel
 * @param {Triple} column
 * @param {number} out where the row begins in hu
 * @param {number} from
 * @param {number} to
 */
function cutRow(hu, { grid, voxels }, at, column, out, from, to) {
  const [I, J] = grid.shape;
  const layer = I * J;
  const [ux, uy, uz] = column;
  const [ax, ay, az] = at;
  for (let x = from; x < to; x += 1) {
    const a = ax + ux * x;
    const b = ay + uy * x;
    const c = az + uz * x;
    const i = a | 0;
    const j = b | 0;
    const k = c | 0;
    const f = a - i;
    const g = b - j;
    const p = k * layer + j * I + i;
    const q = p + I;
    const r = p + layer;
    const s = r + I;
    const p0 = voxels[p] + (voxels[p + 1] - voxels[p]) * f;
    const q0 = voxels[q] + (voxels[q + 1] - voxels[q]) * f;
    const r0 = voxels[r] + (voxels[r + 1] - voxels[r]) * f;
    const s0 = voxels[s] + (voxels[s + 1] - voxels[s]) * f;
    const near = p0 + (q0 - p0) * g;
    hu[out + x] = ((near + (r0 + (s0 - r0) * g - near) * (c - k) + 32768.5) | 0) - 32768; // rounds, also below zero
  }
}

/**
 * HU of one place in LPS mm, rounded as a picture is; null where the volume does not reach.
 * @param {CutVolume} volume
 * @param {Triple} place
 */
export function sampleAt(volume, place) {
  const value = new Int16Array([OUTSIDE]);
  cutPlane(value, volume, { width: 1, height: 1, start: place, u: [0, 0, 0], v: [0, 0, 0] });
  return value[0] === OUTSIDE ? null : value[0];
}

/**
 * HU at an index on the rim of the volume, pulled into it.
 * @param {CutVolume} volume
 * @param {...number} index
 */
function atIndex({ grid, voxels }, ...index) {
  const [I, J] = grid.shape;
  const low = index.map((value, axis) => Math.min(Math.max(0, Math.floor(value)), grid.shape[axis] - 2));
  const [f, g, h] = index.map((value, axis) => Math.min(1, Math.max(0, value - low[axis])));
  let sum = 0;
  for (let corner = 0; corner < 8; corner += 1) {
    const [di, dj, dk] = [corner & 1, (corner >> 1) & 1, corner >> 2];
    const weight = (di ? f : 1 - f) * (dj ? g : 1 - g) * (dk ? h : 1 - h);
    sum += weight * voxels[((low[2] + dk) * J + low[1] + dj) * I + low[0] + di];
  }
  return Math.floor(sum + 0.5);
}

/**
 * First column of a row that lies in the volume, and the one after the last: asked once a row, not once a pixel.
 * @param {Triple} at index of the row's first pixel
 * @param {Triple} column
 * @param {Triple} last
 * @param {number} width
 * @param {number} beyond [voxel] how far beyond the outermost centres counts as within
 * @returns {[number, number]}
 */
function covered(at, column, last, width, beyond) {
  let from = 0;
  let to = width;
  for (let axis = 0; axis < 3; axis += 1) {
    const low = -at[axis] - (beyond > 0 ? beyond : 0); // the first voxel has a neighbour
    const high = last[axis] + beyond - at[axis];
    if (Math.abs(column[axis]) < 1e-12) {
      if (low > 0 || high < 0) return [0, 0];
    } else {
      const ends = [low / column[axis], high / column[axis]];
      from = Math.max(from, Math.ceil(Math.min(...ends)));
      to = Math.min(to, Math.floor(Math.max(...ends)) + 1);
    }
  }
  return from < to ? [from, to] : [0, 0];
}
