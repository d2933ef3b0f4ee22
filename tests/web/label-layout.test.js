// Words beside places of the scene: within the view, apart, and never below a card.
import assert from "node:assert/strict";
import { test } from "node:test";
import { laidOut } from "../../app/web/js/scene-layer/label-layout.js";

const VIEW = { width: 400, height: 300 };
const wish = (fields) => ({ x: 100, y: 100, width: 80, height: 20, first: false, away: 1, ...fields });

test("words stand to the right above their place, and within the view", () => {
  assert.deepEqual(laidOut([wish({})], VIEW, []), [{ x: 112, y: 74 }]);
  assert.deepEqual(laidOut([wish({ x: 380, y: 10 })], VIEW, []), [{ x: 314, y: 6 }]);
  assert.deepEqual(laidOut([wish({ x: 401 }), null], VIEW, []), [null, null]);
});

test("of words that would lie on one another the chosen and then the nearer ones stay", () => {
  assert.deepEqual(laidOut([wish({ away: 2 }), wish({ y: 105 })], VIEW, []), [null, { x: 112, y: 79 }]);
  assert.deepEqual(laidOut([wish({ away: 2, first: true }), wish({ y: 105 })], VIEW, []), [{ x: 112, y: 74 }, null]);
  assert.equal(laidOut([wish({}), wish({ y: 140 })], VIEW, []).filter(Boolean).length, 2);
});

test("words leave the place to what lies upon the scene", () => {
  assert.deepEqual(laidOut([wish({})], VIEW, [{ left: 150, top: 0, right: 300, bottom: 90 }]), [null]);
});
