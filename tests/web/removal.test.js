// The ball of bone removal that is begun where a way ends.
import assert from "node:assert/strict";
import { test } from "node:test";
import { removalBall } from "../../app/tabs/plan/removal.js";

test("the removed ball lets the tool through, and joins the way with a target behind thin bone", () => {
  assert.deepEqual(removalBall([0, 0, 0], [0, 30, 0], 1.5, 0.5), { position: [0, 0, 0], radius: 4 });
  assert.deepEqual(removalBall([0, 0, 0], [0, 30, 0], 4, 0.5), { position: [0, 0, 0], radius: 5.5 });
  assert.deepEqual(removalBall([0, 0, 0], [0, 6, 0], 1.5, 0.5), { position: [0, 3, 0], radius: 6 });
});
