// Which target ‘Inspect’ begins with.
import assert from "node:assert/strict";
import { test } from "node:test";
import { preselected } from "../../app/tabs/rehearse/preselected.js";

const target = (id, ...position) => /** @type {any} */ ({ id, label: id, position });
const cones = (state, found) => /** @type {any} */ ({ state, items: Object.entries(found).map(([id, cone_deg]) => ({ target: id, cone_deg, words: "" })) });
const targets = [target("far", 30, 0, 0), target("blind", 1, 0, 0), target("near", 3, 0, 0)];

test("the nearest target that can be seen is chosen, not the first of the list", () => {
  assert.equal(preselected(targets, cones("current", { far: 20, blind: 0, near: 12 }), [0, 0, 0]), "near");
  assert.equal(preselected(targets, cones("waits", { far: 20, blind: 0, near: 12 }), [0, 0, 0]), "blind"); // nothing is known of these
  assert.equal(preselected(targets, undefined, [29, 0, 0]), "far");
});

test("where none can be seen the nearest one is chosen, and without targets none", () => {
  assert.equal(preselected(targets, cones("current", { far: 0, blind: 0, near: 0 }), [0, 0, 0]), "blind");
  assert.equal(preselected(targets, undefined, null), "far");
  assert.equal(preselected([], undefined, [0, 0, 0]), null);
});
