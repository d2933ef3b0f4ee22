import assert from "node:assert/strict";
import { test } from "node:test";
import { ViewFollower } from "../../app/web/js/scene-layer/view-follower.js";

test("the view goes along with the tip once that is wanted, and not beneath a pointer that pulls", () => {
  const shifts = [];
  const turning = /** @type {any} */ ({ shift: (from, to) => shifts.push([...from, ...to]) });
  const follower = new ViewFollower();
  follower.at([0, 0, 0], turning, false);
  follower.at([5, 0, 0], turning, false);
  assert.deepEqual(shifts, [], "off at first");
  follower.set(true);
  follower.at([5, 0, 0], turning, false);
  follower.at([5, 0, 0.1], turning, false);
  follower.at([6, 0, 0.1], turning, false);
  assert.deepEqual(shifts, [[5, 0, 0, 6, 0, 0.1]]);
  follower.at([7, 0, 0], turning, true);
  follower.at([9, 0, 0], turning, false);
  follower.at([9, 2, 0], turning, false);
  assert.deepEqual(shifts.slice(1), [[9, 0, 0, 9, 2, 0]], "what was pulled meanwhile is not caught up");
  follower.at(undefined, turning, false);
  follower.at([1, 1, 1], turning, false);
  assert.equal(shifts.length, 2);
});
