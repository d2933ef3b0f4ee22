// Which target a search for a path goes to.
import assert from "node:assert/strict";
import { test } from "node:test";
import { NewTarget, targetOf } from "../../app/tabs/plan/wanted-target.js";

const plan = (/** @type {string[]} */ ids, fields = {}) => /** @type {any} */ ({ targets: ids.map((id) => ({ id })), selected: null, nearest_target: null, ...fields });

test("a path goes to the wanted target, else to the one at its end, else to the newest", () => {
  const drawn = plan(["T1", "T2", "T3"], { nearest_target: "T2" });
  assert.deepEqual([targetOf(drawn, "T1"), targetOf(drawn, "gone"), targetOf(plan(["T1", "T2"]), ""), targetOf(plan([]), "")].map((one) => one?.id), ["T1", "T2", "T2", undefined]);
});

test("a target that this window adds is wanted, until another path is chosen", () => {
  const added = new NewTarget();
  const ids = [
    [plan(["T1"], { selected: "T1" }), "a"], // as it was loaded
    [plan(["T1", "T2"], { selected: "T1" }), "a"], // of another window
    [plan(["T1", "T2"], { selected: "T2" }), "a"], // selected, and there before
    [plan(["T1", "T2", "T3"], { selected: "T3" }), "a"],
    [plan(["T1", "T2", "T3"], { selected: "T1" }), "a"],
    [plan(["T1", "T2", "T3"], { selected: "T3" }), "b"],
  ].map(([of, path]) => { added.follow(of, path); return added.id; });
  assert.deepEqual(ids, ["", "", "", "T3", "T3", ""]);
});
