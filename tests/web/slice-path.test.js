import assert from "node:assert/strict";
import { test } from "node:test";
import { PathFrames } from "../../app/web/js/slices/path-frames.js";
import { discsOf } from "../../app/web/js/slices/tool-outline.js";
import { Port } from "../../app/web/js/slices/port.js";
import { cross, dot, length, minus } from "../../app/web/js/slices/vectors.js";

// A quarter of a helix of radius 40 mm that rises by 30 mm: its length is known.
const helix = Array.from(Array(81).keys(), (n) => {
  const a = (n / 80) * Math.PI / 2;
  return [40 * Math.cos(a), 40 * Math.sin(a), (30 * n) / 80];
});
const LONG = Math.hypot(20 * Math.PI, 30);

test("the arc length is the spline's", () => {
  assert.ok(Math.abs(new PathFrames(helix).length - LONG) < 0.01);
});

test("frames are right-handed, stand across the path and do not spin", () => {
  const path = new PathFrames(helix);
  let before = null;
  for (let s = 0; s <= path.length; s += 0.25) {
    const { axes: { u, v, n }, place } = path.at(s);
    for (const [a, b] of [[u, v], [v, n], [n, u]]) assert.ok(Math.abs(dot(a, b)) < 1e-6);
    assert.ok(length(minus(cross(u, v), n)) < 1e-6);
    const angle = Math.atan2(place[1], place[0]);
    const tangent = [-40 * Math.sin(angle), 40 * Math.cos(angle), 60 / Math.PI].map((part) => part / Math.hypot(40, 60 / Math.PI));
    assert.ok(length(minus(n, tangent)) < 0.02, `at ${s}`);
    // the turn from one frame to the next has no part about the path
    if (before) assert.ok(Math.abs(dot(minus(v, before.v), u)) < 2e-3);
    before = { v };
  }
});

test("the nearest arc length, and places beyond the ends", () => {
  const path = new PathFrames(helix);
  assert.ok(Math.abs(path.nearest(helix[40]) - LONG / 2) < 0.5);
  assert.deepEqual(path.at(-5).place, helix[0]);
  assert.ok(length(minus(path.at(1e3).place, helix[80])) < 1e-9);
});

test("a path up the head has frames too, and one place is none", () => {
  const { axes } = new PathFrames([[0, 0, 0], [0, 0, 10]]).at(5);
  assert.ok(Math.abs(dot(axes.v, axes.n)) < 1e-9);
  assert.throws(() => new PathFrames([[1, 1, 1], [1, 1, 1]]));
});

test("the feet stay below along a path to the back, however it begins at the nostril", () => {
  const back = Array.from(Array(30).keys(), (n) => [0, 2 * n, 10]);
  for (const lean of [-36, -24, -12, -2, 0, 2, 12]) { // of the first steps, mm; below 0 to the front
    const path = new PathFrames([[0, -lean - 2, -8], [0, -lean / 2 - 1, 1], ...back]);
    const { axes: { u, v } } = path.at(path.length - 20);
    assert.ok(v[2] < -0.9, `down is to the feet, lean ${lean}`);
    assert.ok(u[0] > 0.9, `the patient's left is right in the picture, lean ${lean}`);
  }
});

test("a path down the head keeps the front above", () => {
  const { axes: { v } } = new PathFrames([[0, 0, 40], [0, 1, 20], [0, 0, 0]]).at(20);
  assert.ok(v[1] > 0.9);
});

test("a round tool is cut as a disc across, as its silhouette along, and not where the plane is beside it", () => {
  const pose = { segments: [[[0, 0, -20], [0, 0, 20]]], radii: [2], margin: 0.5 };
  const across = new Port({ u: [1, 0, 0], v: [0, 1, 0], n: [0, 0, 1] }, [0, 0, 3], 0.1, 200, 200);
  const most = Math.max(...discsOf(across, pose, 0).map(({ radius }) => radius));
  assert.ok(Math.abs(most - 20) < 0.2, "2 mm are 20 pixels");
  const ring = Math.max(...discsOf(across, pose, pose.margin).map(({ radius }) => radius));
  assert.ok(Math.abs(ring - 25) < 0.2);
  const along = new Port({ u: [1, 0, 0], v: [0, 0, -1], n: [0, 1, 0] }, [0, 1.2, 0], 0.1, 200, 200);
  for (const { radius } of discsOf(along, pose, 0)) assert.ok(Math.abs(radius - 16) < 1e-6, "a chord 1.2 mm off the axis");
  const beside = new Port({ u: [1, 0, 0], v: [0, 0, -1], n: [0, 1, 0] }, [0, 2.1, 0], 0.1, 200, 200);
  assert.deepEqual(discsOf(beside, pose, 0), []);
});
