// Whether a path is still the one that ways were found for.
import assert from "node:assert/strict";
import { test } from "node:test";

const { itemAt, pathKey, samePath, surroundingsKey, toolKey } = await import("../../app/tabs/plan/same-path.js");

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
  const plan = { robot: { name: "steady_hand", urdf: null, is_placed: false }, margin_mm: 0.3 };
  const key = (changed, state) => surroundingsKey({ plan, regions: { items: [{ ...region, ...changed }] }, ...state });
  assert.equal(key({}), key({ name: "Left orbit", colour: "#000", visible: false }));
  for (const changed of [{ purpose: "remove" }, { shape: { kind: "sphere", radius: 4 } }, { soft: true }, { margin_mm: 2 }]) assert.notEqual(key({}), key(changed));
  for (const state of [{ plan: { ...plan, margin_mm: 0.5 } }, { plan_use: { registration: "r", state: "ready" } }]) assert.notEqual(key({}), key({}, state));
  assert.notEqual(key({}), key({}, { plan: { ...plan, robot: { ...plan.robot, is_placed: true } } }), "a base that is kept, and one that is placed anew");
});

test("a tool is another one in another shape", () => {
  const tool = { name: "bent", bend_deg: 30, shaft_radius_mm: 1.5, title: "Bent" };
  const keys = [{}, { name: "straight" }, { bend_deg: 45 }, { shaft_radius_mm: 2 }].map((changed) => toolKey(/** @type {any} */ ({ tool: { ...tool, ...changed } })));
  assert.equal(new Set(keys).size, 4);
  assert.equal(toolKey(/** @type {any} */ ({ tool: { ...tool, title: "Other" } })), keys[0]);
});

test("a target that was moved is not where the ways lead", () => {
  const places = path([1, 2, 3], [4, 5, 6]);
  assert.equal(itemAt(places, [4, 5, 6.000001]), places[1]);
  assert.equal(itemAt(places, [1, 2, 3.5]), undefined);
});
