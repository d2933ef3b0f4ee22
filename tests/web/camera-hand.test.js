import assert from "node:assert/strict";
import { test } from "node:test";
import { axesOf } from "../../app/web/js/endoscope/camera-hand.js";
import { arcOf } from "../../app/web/js/endoscope/guidance-arc.js";

const NOW = { depth: 100, insertion: 20, camera: 30, seconds: 0.02 };

test("what a drag owes is sent as speed, and all of it is sent in the end", () => {
  let owed = { right: 1.5, down: -2, depth: /** @type {number | null} */ (null) };
  let [right, down] = [0, 0];
  for (let i = 0; i < 10; i++) {
    const next = axesOf(owed, NOW);
    assert.ok(Math.hypot(next.axes.camera_x, next.axes.camera_y) <= 1 + 1e-9);
    right += next.axes.camera_x * NOW.camera * NOW.seconds;
    down += next.axes.camera_y * NOW.camera * NOW.seconds;
    owed = next.owed;
  }
  assert.ok(Math.abs(right - 1.5) < 1e-9 && Math.abs(down + 2) < 1e-9);
  assert.deepEqual(axesOf(owed, NOW).axes, { camera_x: 0, camera_y: 0, insert: 0 });
});

test("a depth that is wanted is approached at full speed, slower near it, and given up once it is reached", () => {
  const owed = { right: 0, down: 0, depth: 105 };
  assert.equal(axesOf(owed, NOW).axes.insert, 1);
  assert.equal(axesOf(owed, { ...NOW, depth: 110 }).axes.insert, -1);
  const near = axesOf(owed, { ...NOW, depth: 104.5 });
  assert.ok(near.axes.insert > 0 && near.axes.insert < 1);
  assert.equal(near.owed.depth, 105);
  assert.deepEqual(axesOf(owed, { ...NOW, depth: 104.9 }).owed.depth, null);
});

test("an arc is nothing below 0.2 N, amber from there on, and red from 2 N", () => {
  assert.equal(arcOf(0.19), null);
  assert.equal(arcOf(NaN), null);
  assert.equal(arcOf(0.2)?.red, false);
  assert.equal(arcOf(1.99)?.red, false);
  assert.equal(arcOf(2)?.red, true);
  assert.ok((arcOf(1)?.half ?? 0) > (arcOf(0.3)?.half ?? 0));
});
