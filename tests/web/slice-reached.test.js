import assert from "node:assert/strict";
import { test } from "node:test";
import { reachedMm, splitAt } from "../../app/web/js/slices/reached.js";

const LINE = [[0, 0, 0], [0, 3, 0], [0, 3, 4]];

test("a path is parted where the tool gets to", () => {
  assert.deepEqual(splitAt(LINE, 5), [[[0, 0, 0], [0, 3, 0], [0, 3, 2]], [[0, 3, 2], [0, 3, 4]]]);
  assert.deepEqual(splitAt(LINE, 0), [[[0, 0, 0], [0, 0, 0]], LINE]);
  assert.deepEqual(splitAt(LINE, Infinity), [LINE, []]);
  assert.deepEqual(splitAt([], 3), [[], []]);
});

test("only a dry run of the stored path that ended early says how far", () => {
  const corridor = { state: "current", verdict: { figures: [{ name: "reach", level: "fits", whole_mm: null }, { name: "reach", level: "blocked", whole_mm: 90 }], profile: { s_mm: [0, 10, 41.5] } } };
  assert.equal(reachedMm({ corridor }), 41.5);
  assert.equal(reachedMm({ corridor: { ...corridor, verdict: { ...corridor.verdict, figures: [{ name: "reach", level: "fits", whole_mm: 90 }] } } }), null);
  assert.equal(reachedMm({ corridor: { ...corridor, state: "waits" } }), null);
  assert.equal(reachedMm({ corridor: { ...corridor, verdict: null } }), null);
  assert.equal(reachedMm({}), null);
});
