import assert from "node:assert/strict";
import { test } from "node:test";
import { worstFirst } from "../../app/web/js/nearness-order.js";

const near = (name, clearance, margin = 0.5) => ({ name, clearance_mm: clearance, margin_mm: margin, at_least: false, soft: false, level: "fits" });
const names = (structures, order = []) => worstFirst(structures, order).map(({ name }) => name);

test("the least above its margin is first", () => {
  assert.deepEqual(names([near("bone", 2, 0.4), near("nerve", 2.2, 1), near("artery", 0.6)]), ["artery", "nerve", "bone"]);
});

test("what is about as near keeps its place, and what is clearly nearer takes it", () => {
  const order = ["bone", "nerve", "artery"];
  assert.deepEqual(names([near("nerve", 0.9), near("bone", 1.1), near("artery", 5)], order), order);
  assert.deepEqual(names([near("nerve", 0.7), near("bone", 1.1), near("artery", 5)], order), ["nerve", "bone", "artery"]);
  assert.deepEqual(names([near("bone", 3), near("nerve", 2), near("artery", 0.5)], order), ["artery", "nerve", "bone"]);
  assert.deepEqual(names([near("new", 0.1), near("bone", 3)], ["bone"]), ["new", "bone"]);
});
