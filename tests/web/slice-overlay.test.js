import assert from "node:assert/strict";
import { test } from "node:test";
import { cutPlane, OUTSIDE } from "../../app/web/js/slices/cut.js";
import { Grid } from "../../app/web/js/slices/grid.js";
import { blend, IDENTITY, seenFrom, transformOf } from "../../app/web/js/slices/overlay.js";
import { tableOf } from "../../app/web/js/slices/shade.js";

const QUARTER = "0 -1 0 10  1 0 0 20  0 0 1 30  0 0 0 1"; // a quarter turn about the axis of the body, and a shift

test("a transform is read row by row, and what is not rigid is refused", () => {
  assert.deepEqual(transformOf("  "), IDENTITY);
  assert.deepEqual(transformOf("[0, −1, 0, 10; 1, 0, 0, 20; 0, 0, 1, 30; 0, 0, 0, 1]"), QUARTER.split(/\s+/u).map(Number));
  assert.throws(() => transformOf("1 2 3"), /16 numbers/u);
  assert.throws(() => transformOf(QUARTER.replace("0 0 1 30", "0 0 2 30")), /rigid/u);
  assert.throws(() => transformOf(QUARTER.replace(/1$/u, "5")), /last row/u);
  assert.throws(() => transformOf(QUARTER.replace("0 0 1 30", "0 0 -1 30")), /mirrors/u);
  assert.throws(() => transformOf(QUARTER.replace("0 0 1 30", "0 0 1 30000")), /unit/u);
});

test("a place of the second volume is drawn where the transform brings it", () => {
  const grid = new Grid({ shape: [5, 5, 5], transform_index_to_lps: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]] });
  const voxels = new Int16Array(125);
  voxels[2 * 25 + 1 * 5 + 3] = 700; // at (3, 1, 2): turned and shifted to (9, 23, 32)
  const raster = { width: 20, height: 10, start: [0, 18, 32], u: [1, 0, 0], v: [0, 1, 0] };
  const hu = new Int16Array(200).fill(OUTSIDE);
  cutPlane(hu, { grid, voxels }, seenFrom(raster, transformOf(QUARTER)));
  assert.equal(hu[5 * 20 + 9], 700);
  assert.equal(hu.filter((value) => value === 700).length, 1);
  assert.equal(hu[0], OUTSIDE);
});

test("opacity mixes the two, and where the second does not reach the first stays", () => {
  const table = tableOf({ window: 2, level: 0 });
  const [black, white] = [table[-100 & 0xffff], table[100]];
  const mixed = (opacity) => {
    const rgba = Uint32Array.from([black, black, white]);
    blend(rgba, Int16Array.from([100, OUTSIDE, -100]), table, opacity, OUTSIDE);
    return [...rgba].map((word) => word & 0xff);
  };
  assert.deepEqual(mixed(0), [0, 0, 255]);
  assert.deepEqual(mixed(1), [255, 0, 0]);
  assert.deepEqual(mixed(0.5), [127, 0, 127]);
});
