// The verdict in one line.
import assert from "node:assert/strict";
import { test } from "node:test";
import { figureWords, shortWords, unbroken, verdictLine } from "../../app/web/js/verdict-line.js";

const bone = { name: "bone", value: 0.553, digits: 2, whole_mm: null, level: "fits", s_mm: 3 };

test("a line is the word and the worst figure", () => {
  const corridor = (/** @type {any} */ fields) => /** @type {any} */ ({ status: "done", state: "current", level: "fits", word: "Fits", verdict: { figures: [bone] }, ...fields });
  assert.deepEqual(verdictLine(corridor({})), { words: "Fits, bone 0.55 mm", mark: "done" });
  assert.deepEqual(verdictLine(corridor({ level: "pierces", word: "Blocked", verdict: null })), { words: "Blocked", mark: "caution" });
  const nerve = { ...bone, name: "optic nerve", level: "blocked" };
  assert.equal(verdictLine(corridor({ level: "blocked", word: "Blocked", verdict: { figures: [nerve] } })).words, "Blocked, optic nerve");
  assert.deepEqual(["waits", "drag_waits"].map((state) => verdictLine(corridor({ state }))), [{ words: "updating", mark: "" }, { words: "updating", mark: "" }]);
  assert.equal(verdictLine(corridor({ state: "waits", verdict: null })).words, "Simulating …", "nothing was known before");
  assert.equal(verdictLine(corridor({ status: "none" })).words, "");
});

test("a figure has its unit, and a part its whole", () => {
  const words = (/** @type {any} */ fields) => figureWords({ ...bone, ...fields });
  assert.deepEqual([words({}), words({ whole_mm: 81, value: 40, digits: 0 })], ["bone 0.55 mm", "bone 40 of 81 mm"]);
  assert.equal(words({ value: 3, at_least: true }), "bone ≥ 3.00 mm");
  assert.deepEqual([words({ value: null }), words({ value: null, level: "unknown" })], ["bone", "bone ?"]);
});

test("a path that ends before its target says how far", () => {
  assert.deepEqual([0, 0.62, 9.96, 32.4].map(shortWords), ["", "0.6 mm short", "10.0 mm short", "32 mm short"]);
});

const words = (/** @type {string} */ text, /** @type {number | null} */ s_mm = null) => ({ words: text, s_mm });

test("no bracket is left alone at the end of a line", () => {
  const parts = [words(" 1.20 mm to bone "), words("at 43 mm", 43), words(" (margin 0.38)."), words(" Deep ("), words("at 12 mm", 12), words("); 3 mm of it.")];
  const held = unbroken(parts);
  assert.deepEqual(held.filter(({ part }) => part.s_mm !== null).map(({ before, after }) => [before, after]), [["", ""], ["(", ");"]]);
  assert.equal(held.map(({ before, part, after }) => before + part.words + after).join(""), parts.map((part) => part.words).join(""));
});
