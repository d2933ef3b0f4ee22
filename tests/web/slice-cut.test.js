import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { cutPlane, OUTSIDE, sampleAt } from "../../app/web/js/slices/cut.js";
import { Grid } from "../../app/web/js/slices/grid.js";
import { shade, tableOf } from "../../app/web/js/slices/shade.js";

// Values of the engine's Volume.sample; tests/engine/files/test_volume_samples.py makes and checks them.
const SAMPLES = JSON.parse(readFileSync(new URL("volume-samples.json", import.meta.url), "utf8"));
const VOLUME = { grid: new Grid(SAMPLES), voxels: Int16Array.from(SAMPLES.hu) };

test("every sample is the engine's, within half a HU", () => {
  SAMPLES.places.forEach((place, index) => {
    const [value, wanted] = [sampleAt(VOLUME, place), SAMPLES.values[index]];
    if (wanted === null) assert.equal(value, null);
    else assert.ok(Math.abs(value - wanted) <= 0.5 + 1e-9, `${value} for ${wanted}`);
  });
});

test("a plane holds what its pixels' centres sample, and leaves what it does not reach", () => {
  const [start, u, v] = [[-6, 9, 38], [0.31, 0.05, 0.02], [-0.03, 0.2, 0.25]];
  const [width, height] = [37, 29];
  const hu = new Int16Array(width * height).fill(OUTSIDE);
  cutPlane(hu, VOLUME, { width, height, start, u, v });
  let inside = 0;
  for (let y = 0; y < height; y += 1) {
    for (let x = 0; x < width; x += 1) {
      const wanted = sampleAt(VOLUME, start.map((value, axis) => value + u[axis] * x + v[axis] * y));
      if (wanted === null) assert.equal(hu[y * width + x], OUTSIDE);
      else {
        inside += 1;
        assert.ok(Math.abs(hu[y * width + x] - wanted) <= 1); // two ways of rounding the same place
      }
    }
  }
  assert.ok(inside > 50);
});

test("a plane through the last layer of voxels is whole", () => {
  const grid = new Grid({ shape: [3, 3, 3], transform_index_to_lps: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]] });
  const voxels = Int16Array.from(Array(27).keys(), (n) => n * 10 - 130);
  const hu = new Int16Array(9).fill(OUTSIDE);
  cutPlane(hu, { grid, voxels }, { width: 3, height: 3, start: [0, 0, 2], u: [1, 0, 0], v: [0, 1, 0] });
  assert.deepEqual([...hu], [...voxels.slice(18)]);
});

test("window and level go from black to white, and a threshold tints what it takes in", () => {
  const hu = Int16Array.from([-1000, 40, 1000, OUTSIDE]);
  const rgba = new Uint32Array(4);
  shade(rgba, hu, tableOf({ window: 400, level: 40 }));
  assert.deepEqual([...rgba].map((word) => word.toString(16)), ["ff000000", "ff808080", "ffffffff", "ff000000"]);
  const plain = [...rgba];
  shade(rgba, hu, tableOf({ window: 400, level: 40, threshold: { low: 40, high: 900 } }));
  assert.deepEqual([...rgba].map((word, index) => word === plain[index]), [true, false, true, true]);
});
