// What is drawn of a task in the picture: the aiming frame with the time held, and balls in the marker's colour.
import assert from "node:assert/strict";
import { test } from "node:test";
import { frameShare, heldArc } from "../../app/web/js/endoscope/aim-frame.js";
import { markerColour, unitBall } from "../../app/web/js/endoscope/bumps.js";

test("the frame's sides are at 20° in a picture of 70°", () => {
  assert.ok(Math.abs(frameShare(20) - 0.5198) < 1e-4);
  assert.equal(frameShare(35), 1);
});

test("the time held is an arc clockwise from the top, and the whole circle at its end", () => {
  assert.equal(heldArc(20, 0), "");
  assert.equal(heldArc(20, 0.25), "M50 30.00A20 20 0 0 1 70.00 50.00");
  assert.equal(heldArc(20, 0.75), "M50 30.00A20 20 0 1 1 30.00 50.00");
  assert.match(heldArc(20, 1), /^M50 30\.00A20 20 0 1 1 49\.\d+ 30\.00$/);
});

test("a marker goes from blue to bright yellow", () => {
  const [blue, half, yellow] = [0, 0.5, 1].map(markerColour);
  assert.ok(blue[2] > blue[0] && blue[2] > blue[1]);
  assert.ok(yellow[0] > 0.9 && yellow[1] > 0.9 && yellow[2] < 0.2);
  assert.ok(Math.max(...half) - Math.min(...half) > 0.5, "no grey on the way");
  assert.deepEqual(markerColour(0.5 - 1e-12).map((value) => value.toFixed(6)), half.map((value) => value.toFixed(6)));
});

test("a ball's corners are a unit from its middle, and its triangles look outwards", () => {
  const { vertices, corners } = unitBall();
  const at = (/** @type {number} */ corner) => [...vertices.subarray(3 * corner, 3 * corner + 3)];
  for (let i = 0; i < vertices.length / 3; i++) assert.ok(Math.abs(Math.hypot(...at(i)) - 1) < 1e-6);
  let outwards = 0;
  for (let i = 0; i < corners.length; i += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => at(corners[i + k]));
    const [u, v] = [b, c].map((other) => other.map((value, axis) => value - a[axis]));
    const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    const facing = normal[0] * a[0] + normal[1] * a[1] + normal[2] * a[2];
    assert.ok(facing > -1e-9);
    outwards += facing > 1e-6 ? 1 : 0;
  }
  assert.equal(outwards, corners.length / 3 - 48); // but for those without an area at the poles
});
