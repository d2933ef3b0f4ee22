import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { AXES, Port } from "../../app/web/js/slices/port.js";
import { cutShape, drawnNow } from "../../app/web/js/slices/region-cuts.js";

// An axial slice at S 3, ten pixels to a millimetre, its middle at the origin.
const PORT = new Port(AXES.axial, [0, 0, 3], 0.1, 200, 200);
const most = (discs) => Math.max(...discs.map(({ radius }) => radius));

test("a ball is cut as a circle of the chord, and not where the plane misses it", () => {
  assert.ok(Math.abs(most(cutShape(PORT, { kind: "sphere", centre: [0, 0, 0], radius: 5 }).discs) - 40) < 1e-9);
  assert.deepEqual(cutShape(PORT, { kind: "sphere", centre: [0, 0, -3], radius: 5 }).discs, []);
});

test("capsules are the union of their discs", () => {
  const { discs } = cutShape(PORT, { kind: "capsules", points: [[-6, 0, 3], [0, 0, 3], [0, 6, 3]], radius: 1 });
  const xs = discs.map(({ x }) => x);
  const ys = discs.map(({ y }) => y);
  assert.deepEqual([Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)].map(Math.round), [40, 100, 100, 160]);
  assert.equal(most(discs), 10);
});

test("a chain that is being drawn is cut as far as it is clicked", () => {
  const drawing = { purpose: "spare", kind: "capsules", radius_mm: 1, colour: "#123456", words: "", places: [] };
  assert.deepEqual([drawnNow(null), drawnNow(drawing)], [[], []]);
  const [{ shape, colour }] = drawnNow({ ...drawing, places: [[0, 0, 3]] });
  assert.deepEqual([most(cutShape(PORT, shape).discs), colour], [10, "#123456"]);
});

test("a box is cut as a closed polygon with its corners", () => {
  const flat = [1, 0, 0, 2, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
  const [outline] = cutShape(PORT, { kind: "box", half_size: [1, 2, 4], transform_box_to_patient: flat }).lines;
  assert.deepEqual(outline[0], outline.at(-1));
  const corners = outline.slice(0, -1).map((spot) => spot.map(Math.round)).sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  assert.deepEqual(corners, [[110, 80], [110, 120], [130, 80], [130, 120]]);
  assert.deepEqual(cutShape(PORT, { kind: "box", half_size: [1, 2, 2], transform_box_to_patient: flat }).lines, []);
});

test("a half-space is cut as the line where the planes meet", () => {
  const [[a, b]] = cutShape(PORT, { kind: "half_space", point: [4, 0, 0], normal: [1, 0, 0] }).lines;
  assert.deepEqual([a[0], b[0]].map(Math.round), [140, 140]);
  assert.ok(Math.abs(a[1] - b[1]) > 200);
  const [[tilted]] = cutShape(PORT, { kind: "half_space", point: [4, 0, 0], normal: [0.8, 0, 0.6] }).lines;
  assert.ok(Math.abs(tilted[0] - (100 + 10 * (4 - 3 * 0.75))) < 1e-6, "0.8 x + 0.6 z is 3.2 on it");
  assert.deepEqual(cutShape(PORT, { kind: "half_space", point: [4, 0, 0], normal: [0, 0, 1] }).lines, []);
});

test("each kind of shape has a cut, but for a structure, whose surface is drawn elsewhere", () => {
  const middle = new Port(AXES.axial, [0, 0, 0], 0.1, 200, 200);
  const shapes = JSON.parse(readFileSync(new URL("region-shapes.json", import.meta.url), "utf-8"));
  for (const [kind, shape] of Object.entries(shapes)) {
    const { discs, lines } = cutShape(middle, shape);
    assert.equal(discs.length + lines.length > 0, kind !== "structure", kind);
  }
});
