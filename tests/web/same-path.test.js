// Whether a path is still the one that ways were found for.
import assert from "node:assert/strict";
import { test } from "node:test";

const { pathKey, samePath, surroundingsKey } = await import("../../app/tabs/plan/same-path.js");

/** @param {...number[]} positions */
const path = (...positions) => positions.map((position) => ({ position }));

test("a path is the same while its places are, in their order", () => {
  const way = path([7.5, -14, -6], [3, 65, -3.5]);
  assert.ok(samePath(way, path([7.5, -14, -6.0000001], [3, 65, -3.5])));
  assert.ok(!samePath(way, path([7.5, -14, -6], [3, 65, -3.4])));
  assert.ok(!samePath(way, way.slice(0, 1)));
  assert.ok(!samePath([], []));
});

test("a key changes with each place, with their number and their order", () => {
  const keys = [path([1, 2, 3]), path([1, 2, 3.1]), path([1, 2, 3], [4, 5, 6]), path([4, 5, 6], [1, 2, 3]), []].map(pathKey);
  assert.equal(new Set(keys).size, keys.length);
  assert.equal(pathKey(undefined), pathKey([]));
});

test("surroundings change with what a region is, not with how it is shown", () => {
  const region = { id: "r", name: "Orbit", colour: "#fff", visible: true, purpose: "spare", shape: { kind: "sphere", radius: 3 }, soft: false, margin_mm: 1, stiffness_n_per_mm: null, max_depth_mm: null };
  const key = (changed) => surroundingsKey({ plan: { robot: { name: "steady_hand" } }, regions: { items: [{ ...region, ...changed }] } });
  assert.equal(key({}), key({ name: "Left orbit", colour: "#000", visible: false }));
  for (const changed of [{ purpose: "remove" }, { shape: { kind: "sphere", radius: 4 } }, { soft: true }, { margin_mm: 2 }]) assert.notEqual(key({}), key(changed));
});
