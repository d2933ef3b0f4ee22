import assert from "node:assert/strict";
import { test } from "node:test";
import { endoscopeAfter, next } from "../../app/web/js/layout.js";
import { lensOf, project } from "../../app/web/js/endoscope/lens.js";
import { inSight, readMesh } from "../../app/web/js/endoscope/mesh-file.js";
import { ribbons } from "../../app/web/js/endoscope/plan-overlay.js";
import { readerOf } from "../../app/web/js/endoscope/pose-channel.js";

const STRAIGHT = { angle: 0, turn: 0, level: false };
/** Into the head from the front, its side to the top. */
const POSE = { tip: [5, -10, 3], shaft: [0, 2, 0], side: [0, 1, 1] };

const close = (a, b, within = 1e-6) => a.forEach((value, index) => assert.ok(Math.abs(value - b[index]) < within, `${a} is not ${b}`));
const dot = (a, b) => a.reduce((sum, value, index) => sum + value * b[index], 0);

function throughMatrix({ toClip }, place) {
  const [x, y, z, w] = [0, 1, 2, 3].map((row) => toClip[row] * place[0] + toClip[4 + row] * place[1] + toClip[8 + row] * place[2] + toClip[12 + row]);
  return [x / w, y / w, z / w, w];
}

test("straight ahead is the middle, the patient's left is right, and 35° off is the edge", () => {
  const lens = lensOf(POSE, STRAIGHT);
  close(lens.ahead, [0, 1, 0]);
  close(lens.right, [1, 0, 0]);
  close(lens.above, [0, 0, 1]);
  close(project(lens, [5, 20, 3]), [0, 0]);
  close(project(lens, [5 + 10 * Math.tan((35 * Math.PI) / 180), 0, 3]), [1, 0]);
  assert.equal(project(lens, [5, -20, 3]), null);
});

test("the matrix for WebGL says the same, and puts what is near before what is far", () => {
  const lens = lensOf({ tip: [1, 2, 3], shaft: [1, -2, 0.5], side: [0, 0, 1] }, { angle: 30, turn: 50, level: true });
  const place = [1, 2, 3].map((value, axis) => value + 12 * lens.ahead[axis] + 3 * lens.right[axis] - 2 * lens.above[axis]);
  const [x, y, z, w] = throughMatrix(lens, place);
  close([x, y], project(lens, place), 1e-5);
  close([w], [12], 1e-4);
  const farther = throughMatrix(lens, place.map((value, axis) => value + lens.ahead[axis]));
  assert.ok(-1 < z && z < farther[2] && farther[2] < 1);
});

test("a lens is tilted to the side of the tool, and turned about the shaft", () => {
  for (const angle of [30, 45, 70]) {
    const radians = (angle * Math.PI) / 180;
    close(lensOf(POSE, { ...STRAIGHT, angle }).ahead, [0, Math.cos(radians), Math.sin(radians)]);
    close(lensOf(POSE, { ...STRAIGHT, angle, turn: 90 }).ahead, [Math.sin(radians), Math.cos(radians), 0]);
  }
});

test("the head stays upright in a level picture, however the scope is turned", () => {
  for (const turn of [-120, 10, 90, 180]) {
    const { above, right } = lensOf(POSE, { angle: 30, turn, level: true });
    assert.ok(Math.abs(right[2]) < 1e-9 && above[2] > 0.5, `turned by ${turn}°`);
  }
});

test("beside the vertical, where the head has no up, the picture is as the scope is turned", () => {
  const around = [0, 60, 120, 180, 240, 300].map((degrees) => {
    const radians = (degrees * Math.PI) / 180;
    return lensOf({ tip: [0, 0, 0], shaft: [0.07 * Math.cos(radians), 0.07 * Math.sin(radians), 1], side: [0, -1, 0] }, { ...STRAIGHT, level: true }).above;
  });
  around.forEach((above) => assert.ok(dot(above, [0, -1, 0]) > 0.99, `${above}`));
});

/** A file of one triangle in each of two clusters. */
function file() {
  const data = new ArrayBuffer(48 + 20 * 6 + 12 * 2 + 24 * 2);
  new Uint8Array(data).set([..."VFXS"].map((letter) => letter.charCodeAt(0)));
  new Uint32Array(data, 4, 5).set([1, 6, 2, 2, 0]);
  new Uint32Array(data, 48 + 120, 6).set([0, 1, 2, 3, 4, 5]);
  new Float32Array(data, 48 + 120 + 24, 12).set([0, 3, 0, 30, 0, 1, 3, 3, 0, 10, 0, 1]);
  return data;
}

test("a file is read as it was written, and a damaged one is refused", () => {
  const mesh = readMesh(file());
  assert.deepEqual([mesh.count, mesh.vertices.length, [...mesh.corners]], [6, 120, [0, 1, 2, 3, 4, 5]]);
  assert.throws(() => readMesh(file().slice(0, -4)), /damaged/);
  assert.throws(() => readMesh(new ArrayBuffer(3)), /damaged/);
});

test("clusters are drawn from near to far, and those out of sight are left out", () => {
  const { clusters } = readMesh(file());
  const towards = (ahead) => inSight(clusters, { eye: [0, 0, 0], ahead });
  assert.deepEqual(towards([0, 1, 0]), [[3, 3], [0, 3]]);
  assert.deepEqual(towards([0, -1, 0]), []);
  assert.deepEqual(towards([1, 0, 0]), []);
});

test("each piece of a path is a ribbon of two triangles", () => {
  const { vertices, corners } = ribbons([[0, 0, 0], [1, 0, 0], [1, 1, 0]]);
  assert.deepEqual([vertices.length, corners.length, Math.max(...corners)], [2 * 4 * 7, 12, 7]);
  assert.equal(ribbons([[0, 0, 0]]).corners.length, 0);
});

test("a row of poses is read by the names of its numbers", () => {
  const fields = ["t_s", "tip_x", "tip_y", "tip_z", "side_x", "side_y", "side_z", "shaft_x", "shaft_y", "shaft_z"];
  assert.deepEqual(readerOf(fields)(new Float64Array([9, 1, 2, 3, 4, 5, 6, 7, 8, 9])), { tip: [1, 2, 3], side: [4, 5, 6], shaft: [7, 8, 9] });
  assert.throws(() => readerOf(["tip_x"]), /shaft/);
});

test("one key shows the endoscope large, and then beside the scene", () => {
  assert.deepEqual([endoscopeAfter("one-three"), endoscopeAfter("endoscope"), endoscopeAfter("endoscope-beside")], ["endoscope", "endoscope-beside", "endoscope"]);
  assert.equal(next("axial", "axial", "endoscope"), "endoscope");
});
