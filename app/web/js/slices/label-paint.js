// Painted labels on the grid of a volume: strokes as the planner draws them, voxel for voxel, and their tint in a slice.
import { Grid } from "./grid.js";
/** @import { Raster } from "./cut.js" */
/** @import { Triple } from "./grid.js" */

/** @typedef {{ mode: "paint" | "erase", brush: "disc" | "ball", radius_mm: number, normal: Triple }} Brush normal: unit vector across a disc */
/** @typedef {{ grid: Grid, mask: Uint8Array }} MaskVolume mask: 0 or 1, i fastest, then j, then k */

/**
 * Half the thickness of a disc, mm: of a layer of voxels across it; 0 for a ball.
 * @param {number[][]} affine
 * @param {Brush} brush
 */
function halfLayer(affine, { brush, normal }) {
  if (brush === "ball") return 0;
  return 0.5 * Math.max(...[0, 1, 2].map((n) => Math.abs((affine[0][n] * normal[0] + affine[1][n] * normal[1]) + affine[2][n] * normal[2])));
}

/**
 * Draw the brush along a straight line. In the order of the engine's arithmetic (labels/painting.py), so that both
 * round alike and have the same voxels.
 * @param {MaskVolume} volume changed
 * @param {Brush} brush
 * @param {Triple} start LPS mm
 * @param {Triple} end
 */
export function drawLine({ grid, mask }, brush, start, end) {
  const { affine, shape: [I, J] } = grid;
  const half = halfLayer(affine, brush);
  const [low, high] = boxOf(grid, brush.radius_mm + half, start, end);
  const [nx, ny, nz] = brush.normal;
  const disc = brush.brush === "disc";
  let [wx, wy, wz] = [end[0] - start[0], end[1] - start[1], end[2] - start[2]];
  if (disc) {
    const across = (wx * nx + wy * ny) + wz * nz;
    [wx, wy, wz] = [wx - across * nx, wy - across * ny, wz - across * nz];
  }
  const length = (wx * wx + wy * wy) + wz * wz;
  const square = brush.radius_mm * brush.radius_mm;
  const value = brush.mode === "paint" ? 1 : 0;
  const [ax, ay, az] = affine;
  for (let k = low[2]; k < high[2]; k += 1) {
    for (let j = low[1]; j < high[1]; j += 1) {
      const row = (k * J + j) * I;
      for (let i = low[0]; i < high[0]; i += 1) {
        let x = ((ax[0] * i + ax[1] * j) + ax[2] * k) + ax[3] - start[0];
        let y = ((ay[0] * i + ay[1] * j) + ay[2] * k) + ay[3] - start[1];
        let z = ((az[0] * i + az[1] * j) + az[2] * k) + az[3] - start[2];
        if (disc) {
          const away = (x * nx + y * ny) + z * nz;
          if (!(away >= -half && away < half)) continue;
          x -= away * nx;
          y -= away * ny;
          z -= away * nz;
        }
        if (length > 0) {
          const part = Math.min(1, Math.max(0, ((x * wx + y * wy) + z * wz) / length));
          x -= part * wx;
          y -= part * wy;
          z -= part * wz;
        }
        if ((x * x + y * y) + z * z <= square) mask[row + i] = value;
      }
    }
  }
}

/**
 * First indices of the voxels in reach of a line, and those after the last.
 * @param {Grid} grid
 * @param {number} reach mm
 * @param {Triple} start
 * @param {Triple} end
 */
function boxOf(grid, reach, start, end) {
  const [a, b] = [grid.index(start), grid.index(end)];
  const within = (/** @type {number} */ value, /** @type {number} */ axis) => Math.min(grid.shape[axis], Math.max(0, value));
  const margin = grid.toIndex.map((row) => reach * Math.hypot(...row) + 1);
  return [
    margin.map((wide, axis) => within(Math.floor(Math.min(a[axis], b[axis]) - wide), axis)),
    margin.map((wide, axis) => within(Math.ceil(Math.max(a[axis], b[axis]) + wide) + 1, axis)),
  ];
}

/**
 * The voxels of run lengths: without, with, without, and so on. Throws where they do not fill the mask.
 * @param {number} count of voxels
 * @param {Uint32Array} runs
 */
export function maskOfRuns(count, runs) {
  const mask = new Uint8Array(count);
  let at = 0;
  for (let n = 0; n < runs.length; n += 1) {
    if (n & 1) mask.fill(1, at, at + runs[n]);
    at += runs[n];
  }
  if (at !== count) throw new Error(`${at} of ${count} voxels came`);
  return mask;
}

/**
 * Call for every pixel of a raster whose nearest voxel is in the grid, with that voxel's place in the mask.
 * @param {Grid} grid
 * @param {Raster} raster
 * @param {(pixel: number, voxel: number) => void} visit
 */
export function eachNearest(grid, { width, height, start, u, v }, visit) {
  const [I, J, K] = grid.shape;
  const first = grid.index(start);
  const column = grid.step(u);
  const row = grid.step(v);
  for (let y = 0; y < height; y += 1) {
    let [a, b, c] = [0, 1, 2].map((axis) => first[axis] + row[axis] * y + 0.5); // floor rounds then
    for (let x = 0; x < width; x += 1) {
      if (a >= 0 && b >= 0 && c >= 0 && a < I && b < J && c < K) visit(y * width + x, ((c | 0) * J + (b | 0)) * I + (a | 0));
      a += column[0];
      b += column[1];
      c += column[2];
    }
  }
}

/**
 * The grid of every step-th voxel along each axis, from the first.
 * @param {Grid} grid
 * @param {number} step
 */
export function coarser(grid, step) {
  const affine = grid.affine.map((row) => row.map((value, column) => (column < 3 ? value * step : value)));
  return new Grid({ shape: /** @type {Triple} */ (grid.shape.map((count) => Math.ceil(count / step))), transform_index_to_lps: affine });
}

/**
 * Take the tint of a threshold off what is not kept of it.
 * @param {Uint32Array} rgba changed
 * @param {Int16Array} hu
 * @param {Uint32Array} plain grey values without the tint, by HU & 0xffff
 * @param {{ low: number, high: number }} threshold
 * @param {MaskVolume} kept
 * @param {Raster} raster
 */
export function untint(rgba, hu, plain, { low, high }, { grid, mask }, raster) {
  eachNearest(grid, raster, (pixel, voxel) => {
    const value = hu[pixel];
    if (value >= low && value <= high && !mask[voxel]) rgba[pixel] = plain[value & 0xffff];
  });
}

/**
 * Tint what is painted.
 * @param {Uint32Array} rgba changed
 * @param {MaskVolume} volume
 * @param {Raster} raster
 * @param {string} colour '#rrggbb'
 */
export function tintMask(rgba, { grid, mask }, raster, colour) {
  const [red, green, blue] = [1, 3, 5].map((at) => Number.parseInt(colour.slice(at, at + 2), 16));
  const share = 0.5;
  eachNearest(grid, raster, (pixel, voxel) => {
    if (!mask[voxel]) return;
    const word = rgba[pixel];
    const mixed = [word & 255, (word >> 8) & 255, (word >> 16) & 255];
    const [r, g, b] = [red, green, blue].map((part, n) => (mixed[n] * (1 - share) + part * share) | 0);
    rgba[pixel] = (0xff000000 | (b << 16) | (g << 8) | r) >>> 0;
  });
}
