import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { Grid } from "../../app/web/js/slices/grid.js";
import { coarser, drawLine, eachNearest, maskOfRuns, tintMask, untint } from "../../app/web/js/slices/label-paint.js";

// Made by tests/engine/anatomy/test_label_painting.py, which compares it with what the engine draws.
const { shape, affine, strokes, runs } = JSON.parse(readFileSync(new URL("label-strokes.json", import.meta.url), "utf8"));

test("strokes have the voxels that the engine draws", () => {
  const grid = new Grid({ shape, transform_index_to_lps: affine });
  const mask = new Uint8Array(shape[0] * shape[1] * shape[2]);
  for (const { points, ...brush } of strokes) {
    points.forEach((place, at) => {
      if (at || points.length === 1) drawLine({ grid, mask }, brush, points[Math.max(0, at - 1)], place);
    });
  }
  assert.deepEqual(mask, maskOfRuns(mask.length, Uint32Array.from(runs)));
  assert.ok(mask.some(Boolean));
});

test("run lengths that do not fill the mask are refused", () => {
  assert.deepEqual([...maskOfRuns(5, Uint32Array.from([1, 2, 2]))], [0, 1, 1, 0, 0]);
  assert.throws(() => maskOfRuns(5, Uint32Array.from([1, 2])), /3 of 5/u);
});

test("a painted voxel is tinted where it is nearest, and nothing beyond the grid", () => {
  const grid = new Grid({ shape: [3, 3, 3], transform_index_to_lps: [[2, 0, 0, 0], [0, 2, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]] });
  const mask = new Uint8Array(27);
  mask[1 * 9 + 1 * 3 + 2] = 1; // its centre is (4, 2, 2)
  const raster = { width: 8, height: 1, start: [0, 2, 2.9], u: [1, 0, 0], v: [0, 1, 0] };
  const rgba = new Uint32Array(8).fill(0xff000000);
  tintMask(rgba, { grid, mask }, raster, "#ff8000");
  assert.deepEqual([...rgba].map((word) => word !== 0xff000000), [false, false, false, true, true, false, false, false]);
  assert.equal(rgba[3].toString(16), "ff00407f");
  let seen = 0;
  eachNearest(grid, { ...raster, start: [0, 2, 9] }, () => { seen += 1; });
  assert.equal(seen, 0);
});

test("what is not kept of a threshold loses its tint", () => {
  const fine = new Grid({ shape: [5, 2, 2], transform_index_to_lps: [[1, 0, 0, 10], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]] });
  const grid = coarser(fine, 2);
  assert.deepEqual(grid.shape, [3, 1, 1]);
  assert.deepEqual(grid.index([14, 0, 0]), [2, 0, 0]);
  const [mask, hu] = [Uint8Array.from([0, 1, 0]), Int16Array.from([300, 300, 300, 300, 100])];
  const rgba = new Uint32Array(5).fill(7);
  const plain = new Uint32Array(65536).fill(9);
  const raster = { width: 5, height: 1, start: [10, 0, 0], u: [1, 0, 0], v: [0, 1, 0] };
  untint(rgba, hu, plain, { low: 250, high: 3000 }, { grid, mask }, raster);
  assert.deepEqual([...rgba], [9, 7, 7, 9, 7]);
});
