// A rigid transform as six numbers and back.
import assert from "node:assert/strict";
import { test } from "node:test";
import { IDENTITY, transformOf } from "../../app/web/js/slices/overlay.js";
import { poseOf, transformOfPose } from "../../app/web/js/slices/rigid-pose.js";

const near = (a, b, tolerance = 1e-9) => a.forEach((value, at) => assert.ok(Math.abs(value - b[at]) < tolerance, `${a} is not ${b}`));

test("nothing typed moves nothing, and one number moves along or about its own axis", () => {
  assert.deepEqual(transformOfPose([0, 0, 0, 0, 0, 0]), IDENTITY);
  assert.deepEqual(transformOfPose([1, -2, 3, 0, 0, 0]), [1, 0, 0, 1, 0, 1, 0, -2, 0, 0, 1, 3, 0, 0, 0, 1]);
  near(transformOfPose([0, 0, 0, 90, 0, 0]), [1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1]); // y to z
  near(transformOfPose([0, 0, 0, 0, 90, 0]), [0, 0, 1, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 0, 1]); // z to x
  near(transformOfPose([0, 0, 0, 0, 0, 90]), [0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]); // x to y
});

test("six numbers come back, and what they make is rigid", () => {
  for (const pose of [[1, 2, 3, 10, -20, 30], [-5.5, 0, 7, -170, 45, 120], [0, 0, 0, 5, 0, 0], [0, 0, 0, 0, 89.9, -60]]) {
    const transform = transformOfPose(pose);
    near(poseOf(transform), pose, 1e-6);
    assert.deepEqual(transformOf(transform.map(String).join(" ")), transform);
  }
});

test("at a right angle about y other numbers make the same transform", () => {
  for (const about of [90, -90]) {
    const transform = transformOfPose([1, 2, 3, 20, about, 50]);
    near(transformOfPose(poseOf(transform)), transform, 1e-6);
  }
});
