import assert from "node:assert/strict";
import { test } from "node:test";
import { angle, Measures, measureWords } from "../../app/web/js/slices/measures.js";
import { cutMesh, meshOf } from "../../app/web/js/slices/mesh-cut.js";

test("lengths and angles are in millimetres, not in voxels", () => {
  assert.equal(measureWords({ kind: "distance", places: [[0, 0, 0], [3, 4, 12]] }), "13.0 mm");
  assert.ok(Math.abs(angle([1, 0, 0], [0, 0, 0], [1, 0, 2]) - 63.4349) < 1e-3);
  assert.equal(measureWords({ kind: "angle", places: [[5, 0, 0], [0, 0, 0], [0, 0, 7]] }), "90.0°");
  assert.equal(angle([0, 0, 0], [0, 0, 0], [1, 0, 0]), 0);
});

test("measures are made place by place, the last few are kept, and Escape drops the open one", () => {
  const measures = new Measures();
  for (let n = 0; n < 9; n += 1) {
    measures.add("distance", [n, 0, 0]);
    measures.point([n, 5, 0]);
    assert.equal(measureWords(measures.shown.at(-1)), "5.0 mm");
    measures.add("distance", [n, 10, 0]);
  }
  assert.deepEqual(measures.done.map(({ places }) => places[0][0]), [3, 4, 5, 6, 7, 8]);
  measures.add("angle", [0, 0, 0]);
  assert.equal(measures.cancel(), true);
  assert.equal(measures.cancel(), false);
  assert.equal(measures.shown.length, 6);
  measures.clear();
  assert.deepEqual(measures.shown, []);
});

/** A box from −1 to 1 mm, as the planner sends a surface. */
function box() {
  const vertices = Array.from(Array(8).keys(), (n) => [n & 1 ? 1 : -1, n & 2 ? 1 : -1, n & 4 ? 1 : -1]).flat();
  const faces = [0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5];
  const buffer = new ArrayBuffer(8 + 8 * 3 * 4 + faces.length * 4);
  new Uint32Array(buffer, 0, 2).set([8, faces.length / 3]);
  new Float32Array(buffer, 8, 24).set(vertices);
  new Uint32Array(buffer, 8 + 96).set(faces);
  return meshOf(buffer);
}

test("a mesh's outline has the length of the cut, in pixels", () => {
  const raster = { width: 100, height: 100, start: [-5, -5, 0.3], u: [0.1, 0, 0], v: [0, 0.1, 0] };
  const pieces = cutMesh(box(), raster);
  let long = 0;
  for (let n = 0; n < pieces.length; n += 4) long += Math.hypot(pieces[n + 2] - pieces[n], pieces[n + 3] - pieces[n + 1]);
  assert.ok(Math.abs(long - 80) < 1e-3); // four sides of 2 mm
  assert.ok(Math.min(...pieces) > 40.4 && Math.max(...pieces) < 60.6, "pixel centres are at .5");
  assert.deepEqual(cutMesh(box(), { ...raster, start: [-5, -5, 1.5] }), []);
});
