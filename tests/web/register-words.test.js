// The Register step's words: what is known of a point, bars, typed numbers, orders.
import assert from "node:assert/strict";
import { test } from "node:test";
import { barScale, barShare, fleWords, orderWords, pairWords, rowWords, threeNumbers } from "../../app/steps/register/words.js";

/** @param {object} fields */
const pair = (fields) => /** @type {any} */ ({ in_image: [1, 2, 3], measured: [4, 5, 6], enabled: true, measured_from: "typed", residual_mm: 0.3, ...fields });

test("a point says what is missing, how it was measured, and that it is left out", () => {
  assert.equal(pairWords(pair({ measured: null })), "not measured yet");
  assert.equal(pairWords(pair({ in_image: null })), "measured, not in the image yet");
  assert.equal(pairWords(pair({ measured_from: "simulated" })), "simulated touch");
  assert.equal(pairWords(pair({ enabled: false })), "typed, left out");
});

test("a bar is full at the largest residual, and small residuals do not look large", () => {
  assert.equal(barScale([pair({}), pair({ residual_mm: null })]), 1);
  assert.equal(barScale([pair({ residual_mm: 4 }), pair({})]), 4);
  assert.equal(barShare(0.3, 1), 0.3);
  assert.equal(barShare(null, 1), 0);
  assert.equal(barShare(9, 4), 1);
});

test("three numbers are a place, three empty fields are none, and anything else waits", () => {
  assert.deepEqual(threeNumbers(["1", "-2.5", "3,25"]), { place: [1, -2.5, 3.25], complete: true });
  assert.deepEqual(threeNumbers(["", " ", ""]), { place: null, complete: true });
  assert.deepEqual(threeNumbers(["1", "", "3"]), { place: null, complete: false });
  assert.deepEqual(threeNumbers(["1", "x", "3"]), { place: null, complete: false });
});

test("an error says where it is expected, and what it was computed from", () => {
  assert.equal(rowWords(/** @type {any} */ ({ label: "ostium", s_mm: null })), "ostium");
  assert.equal(rowWords(/** @type {any} */ ({ label: "", s_mm: 41.6 })), "Worst along the path, at 42 mm");
  assert.equal(fleWords(/** @type {any} */ ({ fle_mm: 0.5, fle_source: "stated", used: 5 })), "0.50 mm, as stated");
  assert.equal(fleWords(/** @type {any} */ ({ fle_mm: 0.312, fle_source: "estimated", used: 5 })), "0.31 mm, estimated from the fit of 5 points");
  assert.equal(fleWords(/** @type {any} */ ({ fle_mm: null, fle_source: "none", used: 0 })), "not known yet");
});

test("an order tells only what it changes", () => {
  const orders = /** @type {any} */ ({ pairs: ["A", "B", "C"], candidates: [{ labels: ["B", "A", "C"] }, { labels: ["A", "B", "C"] }] });
  assert.equal(orderWords(orders, 0), "A ← B, B ← A");
  assert.equal(orderWords(orders, 1), "As they are now");
});
