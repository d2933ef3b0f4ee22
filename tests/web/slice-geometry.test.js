import assert from "node:assert/strict";
import { test } from "node:test";
import { sizeOf, toPatient, toPicture } from "../../app/web/js/slice-geometry.js";

// A sagittal slice at L 4: columns go to the back, rows go down; pixels of 2 × 0.5 mm.
const PLANE = { columns: 10, rows: 40, origin: [4, -10, 30], u: [0, 2, 0], v: [0, 0, -0.5], position: 4, lo: -80, hi: 80, step: 0.5, detail: null };
const NORMAL = 0;

test("the size counts whole pixels", () => {
  assert.deepEqual(sizeOf(PLANE), { width: 20, height: 20 });
});

test("the origin is the centre of the first pixel", () => {
  assert.deepEqual(toPicture(PLANE, NORMAL, PLANE.origin), { x: 1, y: 0.25, away: 0 });
  assert.deepEqual(toPatient(PLANE, 1, 0.25), PLANE.origin);
});

test("there and back again", () => {
  for (const point of [[4, -9.3, 29.8], [4, 0, 20], [4, 8.9, 10.4]]) {
    const { x, y, away } = toPicture(PLANE, NORMAL, point);
    assert.equal(away, 0);
    toPatient(PLANE, x, y).forEach((value, axis) => assert.ok(Math.abs(value - point[axis]) < 1e-9));
  }
});

test("a point beside the plane has its signed distance", () => {
  assert.equal(toPicture(PLANE, NORMAL, [7.5, 0, 20]).away, 3.5);
  assert.equal(toPicture(PLANE, NORMAL, [-1, 0, 20]).away, -5);
});

test("beside the picture is no place", () => {
  for (const [x, y] of [[-0.1, 5], [20.1, 5], [5, -0.1], [5, 20.1]]) assert.equal(toPatient(PLANE, x, y), null);
});
