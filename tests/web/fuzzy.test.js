import assert from "node:assert/strict";
import { test } from "node:test";
import { rank } from "../../app/web/js/fuzzy.js";

test("the beginning of a name comes before that of a word, anything within, scattered letters", () => {
  const ranks = ["Rename plan", "Plan rename", "Prename", "Re-enter a name"].map((name) => rank("rename", name));
  assert.deepEqual(ranks, [0, 1, 2, 3]);
});

test("each word has to fit, in any order", () => {
  assert.equal(rank("plan ren", "Rename plan"), 1);
  assert.equal(rank("plan xy", "Rename plan"), null);
});

test("accents, case and punctuation do not matter", () => {
  assert.equal(rank("muller", "Müller, CT 1"), 0);
  assert.equal(rank("CT-1", "Müller, CT 1"), 1);
});

test("everything fits what is not typed yet", () => assert.equal(rank("  ", "Anything"), 0));
