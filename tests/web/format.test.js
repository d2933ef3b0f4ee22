import assert from "node:assert/strict";
import { test } from "node:test";
import { count, fixed, mm, sentence, thousands, when, whenExactly } from "../../app/web/js/format.js";

test("a number has fixed digits and a real minus", () => {
  assert.equal(fixed(1.25, 1), "1.3");
  assert.equal(fixed(-2, 2), "−2.00");
  assert.equal(mm(3.14159, 2), "3.14 mm");
});

test("what rounds to zero has no sign", () => {
  assert.equal(fixed(-0.004, 2), "0.00");
  assert.equal(fixed(-0, 0), "0");
});

test("what is no number is a dash", () => {
  for (const value of [null, undefined, NaN, Infinity]) assert.equal(fixed(value, 1), "–");
});

test("words become a sentence", () => {
  assert.equal(sentence("the tool fits"), "The tool fits");
  assert.equal(sentence(""), "");
});

test("thousands are set apart, and one is singular", () => {
  assert.equal(count(1, "bead", "beads"), "1 bead");
  assert.equal(count(1234567, "triangle", "triangles"), "1,234,567 triangles");
  assert.equal(thousands(-60000), "−60,000");
  assert.equal(thousands(999), "999");
});

test("a date is written for the reader, and what is none is left out", () => {
  assert.match(when("2026-03-05T10:00:00Z"), /2026/);
  assert.equal(when("yesterday"), "");
  assert.match(whenExactly("2026-03-05T10:17:00Z"), /2026.*:17/);
  assert.equal(whenExactly("yesterday"), "");
});
