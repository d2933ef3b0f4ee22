import assert from "node:assert/strict";
import { test } from "node:test";
import { aboutAll, aboutNone, closeUp, cloudOf, digitsOf, nearestPlace, shaped } from "../../app/tabs/review/path-places.js";
import { readSwept } from "../../app/tabs/review/swept-file.js";
import { nearColour } from "../../app/web/js/near-scale.js";
import { within } from "../../app/web/js/scene-layer/near-patch.js";

/** @type {any} */
const SERIES = {
  phases: ["free", "approach", "follow", "done"], phase: [1, 2, 2, 3, 0],
  across_mm: [[9, 0.1, null, -0.2, 7], [9, -0.3, null, 0.4, 7]],
};

test("the cloud has the samples that follow the path, with their numbers", () => {
  assert.deepEqual(cloudOf(SERIES), [{ index: 1, place: [0.1, -0.3] }, { index: 3, place: [-0.2, 0.4] }]);
  assert.deepEqual(cloudOf({ ...SERIES, across_mm: null }), []);
});

test("windows hold what they are to show, and a millimetre has one length in them", () => {
  const { x, y } = aboutNone([[0.1, -0.3], [-0.2, 0.4]]);
  assert.ok(x[0] === -x[1] && x[1] >= 0.4 && x[1] < 0.5 && y[1] === x[1]);
  assert.ok(aboutNone([])[/** @type {"x"} */ ("x")][1] > 0, "no error has a scale too");
  const all = aboutAll([[0, 0], [40, 10]]);
  assert.ok(all.x[0] < 0 && all.x[1] > 40 && all.y[0] < 0 && all.y[1] > 10);
  for (const shape of [0.5, 1, 4]) {
    const one = shaped(all, shape);
    assert.ok(Math.abs((one.x[1] - one.x[0]) / (one.y[1] - one.y[0]) - shape) < 1e-9);
    assert.ok(one.x[0] <= all.x[0] && one.x[1] >= all.x[1] && one.y[0] <= all.y[0] && one.y[1] >= all.y[1]);
  }
  assert.deepEqual(closeUp([10, 2], 0), { x: [9.5, 10.5], y: [1.5, 2.5] });
  assert.ok(closeUp([10, 2], 4).y[1] > 6);
});

test("a press finds the nearest place, and axes have the digits that they need", () => {
  assert.equal(nearestPlace([[0, 0], [3, 1], [5, 5]], [3.4, 2]), 1);
  assert.equal(nearestPlace([], [0, 0]), -1);
  assert.deepEqual([[0, 100], [0, 2], [-0.4, 0.4], [-0.001, 0.001]].map((range) => digitsOf(/** @type {[number, number]} */ (range))), [0, 1, 1, 4]);
});

test("a file of a swept volume is read by its header, and refused when it is cut off", () => {
  const data = new ArrayBuffer(36 + 12 * (3 + 1 + 2 + 1) + 4 * 2);
  new Uint32Array(data, 0, 6).set([0x57584656, 1, 3, 1, 2, 1]);
  new Float32Array(data, 24, 3).set([5, -0.5, 1234]);
  new Float32Array(data, 36, 9).set([1, 2, 3, 4, 5, 6, 7, 8, 9]);
  new Uint32Array(data, 72, 3).set([0, 1, 2]);
  new Float32Array(data, 84, 6).set([10, 11, 12, 13, 14, 15]);
  new Uint32Array(data, 108, 3).set([0, 1, 1]);
  new Float32Array(data, 120, 2).set([-0.5, 4]);
  const { body, near, least, volume } = readSwept(data);
  assert.deepEqual([least, volume, near.reach], [-0.5, 1234, 5]);
  assert.deepEqual([[...body.positions], [...body.indices]], [[1, 2, 3, 4, 5, 6, 7, 8, 9], [0, 1, 2]]);
  assert.deepEqual([[...near.positions], [...near.indices], [...near.least]], [[10, 11, 12, 13, 14, 15], [0, 1, 1], [-0.5, 4]]);
  assert.throws(() => readSwept(data.slice(0, -4)), /damaged/u);
  assert.throws(() => readSwept(new ArrayBuffer(8)), /damaged/u);
});

test("near passes go from red to the colour of bone, and the tool in bone stands out", () => {
  const bone = [0.5, 0.5, 0.4];
  const [contact, touch, one, far] = [-0.1, 0, 1, 5].map((least) => nearColour(least, 5, bone));
  assert.deepEqual(far, bone);
  assert.ok(touch[0] > 2 * touch[1] && one[1] > touch[1], "warmer, then lighter");
  assert.ok(contact[2] > contact[1] && contact[0] < touch[0], "not one of the scale");
  const reds = [0, 0.4, 1, 2, 3, 4].map((least) => nearColour(least, 5, bone)[1]);
  assert.deepEqual([...reds].slice(0, 5), [...reds].slice(0, 5).sort((a, b) => a - b));
});

test("what a cut has taken away of bone has no colours either", () => {
  const near = { positions: new Float32Array([0, 0, 0, 3, 0, 0, 0, 3, 0, 9, 0, 0, 12, 0, 0, 9, 3, 0]), indices: new Uint32Array([0, 1, 2, 3, 4, 5]), least: new Float32Array(6), reach: 5 };
  const box = (/** @type {number} */ low, /** @type {number} */ high) => ({ min: { x: low }, max: { x: high } });
  assert.deepEqual([...within(near, box(-50, 50))], [0, 1, 2, 3, 4, 5]);
  assert.deepEqual([...within(near, box(-50, 5))], [0, 1, 2]);
  assert.deepEqual([...within(near, box(5, 50))], [3, 4, 5]);
});
