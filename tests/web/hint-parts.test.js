// The line that says what to do next: a tab that it names can be pressed.
import assert from "node:assert/strict";
import { test } from "node:test";
import { partsOf } from "../../app/web/js/hint-parts.js";

const TABS = [{ name: "plan", label: "Plan" }, { name: "register", label: "Register" }, { name: "rehearse", label: "Rehearse" }];
const button = (tab, words) => ({ tab, words, inline: false });
const link = (tab, words) => ({ tab, words, inline: true });

test("a sentence that only leads to a tab is its button", () => {
  assert.deepEqual(partsOf("Go to Rehearse.", TABS), [button("rehearse", "Go to Rehearse")]);
  assert.deepEqual(partsOf("Drag to turn the head. Then go to Plan.", TABS), ["Drag to turn the head.", button("plan", "Go to Plan")]);
});

test("within a sentence the name alone is pressed", () => {
  assert.deepEqual(partsOf("Add a target, or go to Rehearse.", TABS), ["Add a target, or go to ", link("rehearse", "Rehearse"), "."]);
  assert.deepEqual(partsOf("Measure better in Register, or move points.", TABS), ["Measure better in ", link("register", "Register"), ", or move points."]);
  assert.deepEqual(partsOf("In use. Go to Plan for the verdict.", TABS), ["In use. Go to ", link("plan", "Plan"), " for the verdict."]);
});

test("other words stay as they are, and so does a tab that cannot be opened", () => {
  assert.deepEqual(partsOf("Open a plan under Plans, or make one.", TABS), ["Open a plan under Plans, or make one."]);
  assert.deepEqual(partsOf("Return to Planning in Registered heads.", TABS), ["Return to Planning in Registered heads."]);
  assert.deepEqual(partsOf("Go to Rehearse.", TABS.slice(0, 2)), ["Go to Rehearse."]);
  assert.deepEqual([partsOf("Go to Plan.", []), partsOf("", TABS)], [["Go to Plan."], []]);
});
