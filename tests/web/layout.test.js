import assert from "node:assert/strict";
import { test } from "node:test";
import { Layouts, next } from "../../app/web/js/layout.js";

test("a view asked for fills the page, and goes back when it is asked for again", () => {
  assert.equal(next("one-three", "axial", "one-three"), "axial");
  assert.equal(next("axial", "axial", "two-by-two"), "two-by-two");
  assert.equal(next("axial", "scene", "two-by-two"), "scene");
});

test("no view in particular is several of them, and several stay when they are asked for again", () => {
  assert.equal(next("coronal", null, "one-three"), "one-three");
  assert.equal(next("two-by-two", "two-by-two", "two-by-two"), "two-by-two");
});

test("the endoscope is kept beside the layout of several views that other steps have", () => {
  /** @type {Record<string, string>} */
  const kept = {};
  const fields = { layout: "two-by-two", plain: "two-by-two", several: "two-by-two", available: true, path: false, endoscope: true, render: () => {} };
  Object.assign(globalThis, { localStorage: { setItem: (/** @type {string} */ key, /** @type {string} */ value) => { kept[key] = value; } } });
  const layouts = Object.assign(Object.create(Layouts.prototype), fields);
  layouts.swapEndoscope();
  assert.deepEqual([layouts.layout, layouts.plain, layouts.before], ["endoscope", "two-by-two", "endoscope"]);
  assert.ok(!Object.values(kept).some((value) => value === "two-by-two") && Object.values(kept).includes("endoscope"));
  layouts.endoscope = false;
  assert.equal(layouts.before, "two-by-two");
});

test("a layout that is fixed cannot be left, is not remembered, and gives way to the one from before", () => {
  const kept = /** @type {Record<string, string>} */ ({});
  Object.assign(globalThis, { localStorage: { setItem: (/** @type {string} */ key, /** @type {string} */ value) => { kept[key] = value; } } });
  const fields = { shared: "two-by-two", first: false, fixed: null, plain: "two-by-two", several: "two-by-two", available: true, path: true, sliced: true, endoscope: true, render: () => {} };
  const layouts = Object.assign(Object.create(Layouts.prototype), fields);
  layouts.fix("endoscope-alone");
  for (const other of ["axial", "one-three"]) {
    layouts.set(other);
    assert.equal(layouts.can(other), false);
  }
  assert.equal(layouts.can("endoscope-alone"), true);
  layouts.swapEndoscope();
  layouts.fix(null);
  assert.deepEqual([layouts.layout, kept], ["two-by-two", {}]);
  layouts.set("axial");
  assert.equal(layouts.layout, "axial");
});
