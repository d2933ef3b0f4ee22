// Arrow keys among controls that stand in rows.
import assert from "node:assert/strict";
import { test } from "node:test";
import { rowStep } from "../../app/web/js/roving.js";

test("an arrow down leads to the row below, and to its last control where that row is shorter", () => {
  const down = (/** @type {number} */ at) => rowStep(at, 1, 5, 3); // three above two
  assert.deepEqual([0, 1, 2, 3, 4].map(down), [3, 4, 4, 3, 4]);
  assert.deepEqual([0, 2, 3, 4].map((at) => rowStep(at, -1, 5, 3)), [0, 2, 0, 1]);
  assert.equal(rowStep(1, 1, 2, 2), 1, "the only row");
});
