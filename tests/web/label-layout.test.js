// Words beside places of the scene: within the view, apart, and never below a card.
import assert from "node:assert/strict";
import { test } from "node:test";
import { clearOf, laidOut } from "../../app/web/js/scene-layer/label-layout.js";

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

test("a letter goes beside what lies upon the scene, by the shortest way that is free", () => {
  const [size, bar] = [{ width: 10, height: 18 }, { left: 10, top: 10, right: 300, bottom: 40 }];
  assert.deepEqual(clearOf({ x: 100, y: 60 }, size, VIEW, [bar]), { x: 100, y: 60 });
  assert.deepEqual(clearOf({ x: 100, y: 45 }, size, VIEW, [bar]), { x: 100, y: 52 });
  assert.deepEqual(clearOf({ x: 298, y: 30 }, size, VIEW, [bar]), { x: 308, y: 30 });
  const below = { left: 80, top: 41, right: 120, bottom: 75 };
  assert.deepEqual(clearOf({ x: 100, y: 35 }, size, VIEW, [bar, below]), null, "both ways are too far");
  assert.deepEqual(clearOf({ x: 100, y: 62 }, size, VIEW, [bar, below]), { x: 100, y: 87 });
});
