import assert from "node:assert/strict";
import { test } from "node:test";
import { next } from "../../app/web/js/layout.js";

test("a view asked for fills the page, and goes back when it is asked for again", () => {
  assert.equal(next("one-three", "axial", "one-three"), "axial");
  assert.equal(next("axial", "axial", "two-by-two"), "two-by-two");
  assert.equal(next("axial", "scene", "two-by-two"), "scene");
});

test("no view in particular is several of them, and several stay when they are asked for again", () => {
  assert.equal(next("coronal", null, "one-three"), "one-three");
  assert.equal(next("two-by-two", "two-by-two", "two-by-two"), "two-by-two");
});
