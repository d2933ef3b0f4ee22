import assert from "node:assert/strict";
import { test } from "node:test";
import { cutNear } from "../../app/web/js/near-plane.js";

const place = (x, away) => ({ x, y: 0, away });
const shape = (runs) => runs.map(({ near, places }) => [near, places.map(({ x }) => x)]);

test("a line in the plane is one near run", () => {
  assert.deepEqual(shape(cutNear([place(0, 0), place(1, 1), place(2, -1)], 2)), [[true, [0, 1, 2]]]);
});

test("a line through the plane is cut at both limits", () => {
  assert.deepEqual(shape(cutNear([place(0, -4), place(8, 4)], 2)), [[false, [0, 2]], [true, [2, 6]], [false, [6, 8]]]);
});

test("one long segment that goes away is cut once", () => {
  assert.deepEqual(shape(cutNear([place(0, 0), place(10, 5)], 2)), [[true, [0, 4]], [false, [4, 10]]]);
});

test("a segment parallel to the plane is not cut", () => {
  assert.deepEqual(shape(cutNear([place(0, 3), place(5, 3)], 2)), [[false, [0, 5]]]);
});

test("runs join over segments of one kind", () => {
  assert.deepEqual(shape(cutNear([place(0, 5), place(1, 4), place(2, 3)], 2)), [[false, [0, 1, 2]]]);
});

test("fewer than two places are no line", () => {
  assert.deepEqual(cutNear([], 2), []);
  assert.deepEqual(cutNear([place(0, 0)], 2), []);
});
