import assert from "node:assert/strict";
import { test } from "node:test";
import { Crosshair } from "../../app/web/js/slices/crosshair.js";
import { GreyValues, OWN } from "../../app/web/js/slices/grey-values.js";

const wait = (ms) => new Promise((resolve) => { setTimeout(resolve, ms); });
const slices = (cross, greys = {}) => ({
  cross, window_name: "sinus", window: 2000, level: -200, ...greys,
  planes: { axial: { lo: -50, hi: 50 }, coronal: { lo: -60, hi: 60 }, sagittal: { lo: -70, hi: 70 } },
});
const connection = () => {
  const sent = [];
  return { connected: true, sent, send: (type, fields) => sent.push([type, fields]) };
};

test("the crosshair moves at once, and its answers do not pull it back", async () => {
  const line = connection();
  const cross = new Crosshair(line);
  const moves = [];
  cross.addEventListener("elsewhere", () => moves.push("elsewhere"));
  cross.heard(slices([0, 0, 0]));
  cross.move([0, 0, 1]);
  cross.move([0, 0, 2]);
  assert.deepEqual(cross.place, [0, 0, 2]);
  await wait(80);
  cross.move([0, 0, 3]);
  cross.heard(slices([0, 0, 2])); // the answer to what was sent first
  assert.deepEqual(cross.place, [0, 0, 3]);
  await wait(80);
  cross.heard(slices([0, 0, 3]));
  assert.equal(cross.wanted, null);
  assert.deepEqual(line.sent.map(([, { position }]) => position[2]), [2, 3]);
  assert.deepEqual(moves, ["elsewhere"], "the first place alone came from elsewhere");
  cross.heard(slices([5, 5, 5]));
  assert.deepEqual(cross.place, [5, 5, 5]);
  assert.deepEqual(moves, ["elsewhere", "elsewhere"]);
});

test("the crosshair stays in the scan, and a dead line forgets its wishes", async () => {
  const line = connection();
  const cross = new Crosshair(line);
  cross.heard(slices([0, 0, 0]));
  cross.move([500, -500, 0]);
  assert.deepEqual(cross.place, [70, -60, 0]);
  line.connected = false;
  await wait(80);
  assert.deepEqual(cross.place, [0, 0, 0]);
  assert.deepEqual(line.sent, []);
});

test("a drag sets window and level within what the planner takes, and its own answers change nothing", async () => {
  const line = connection();
  const greys = new GreyValues(line);
  greys.heard(slices([0, 0, 0]));
  greys.drag(10, -5);
  assert.deepEqual([greys.name, greys.window, greys.level], [OWN, 2080, -240]);
  greys.drag(-1e6, 1e6);
  assert.deepEqual([greys.window, greys.level], [1, 4000]);
  await wait(120);
  assert.deepEqual(line.sent, [["slice.window", { name: OWN, window: 1, level: 4000 }]]);
  let changes = 0;
  greys.addEventListener("change", () => { changes += 1; });
  greys.heard(slices([0, 0, 0], { window_name: OWN, window: 1, level: 4000 }));
  assert.equal(changes, 0);
  greys.heard(slices([0, 0, 0], { window_name: "bone", window: 2500, level: 600 }));
  assert.deepEqual([greys.name, greys.window, changes], ["bone", 2500, 1]);
});
