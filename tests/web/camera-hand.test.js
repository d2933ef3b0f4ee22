import assert from "node:assert/strict";
import { afterEach, mock, test } from "node:test";
import { CameraHand, MM_PER_PX, axesOf } from "../../app/web/js/endoscope/camera-hand.js";
import { arcOf } from "../../app/web/js/endoscope/guidance-arc.js";

const NOW = { depth: 100, insertion: 20, camera: 30, seconds: 0.02 };

/** A hand in a picture of 480 pixels whose timer comes every `every` ms, and what the robot's camera was moved by it. @param {number} every */
function handAt(every) {
  /** @type {[string, any][]} */
  const sent = [];
  /** @type {number[]} */
  const captured = [];
  const moved = { right: 0, down: 0 };
  let [now, axes] = [0, { camera_x: 0, camera_y: 0, insert: 0 }];
  const state = { rehearsal: { state: "running", mine: true }, snake: { depth_mm: 100, length_mm: 800, insertion_mm_per_s: 20, camera_mm_per_s: NOW.camera } };
  const connection = { state, send: (/** @type {string} */ type, /** @type {any} */ message) => { sent.push([type, message]); axes = message; } };
  mock.method(performance, "now", () => now);
  mock.timers.enable({ apis: ["setInterval"] });
  const picture = { clientWidth: 480 };
  const pane = { addEventListener() {}, classList: { toggle() {} }, setPointerCapture: (/** @type {number} */ id) => captured.push(id) };
  globalThis.window = /** @type {any} */ ({ addEventListener() {} });
  const hand = new CameraHand(/** @type {any} */ (pane), /** @type {any} */ (picture), /** @type {any} */ (connection), /** @type {any} */ ({ hold() {} }));
  hand.follow(/** @type {any} */ (state), true);
  const pass = (/** @type {number} */ ms) => {
    moved.right += (axes.camera_x * NOW.camera * ms) / 1000;
    moved.down += (axes.camera_y * NOW.camera * ms) / 1000;
    now += ms;
  };
  return { hand, sent, moved, pane, picture, captured, tick: (ms = every) => { pass(ms); if (hand.timer !== undefined) hand.tell(); } };
}

afterEach(() => {
  mock.restoreAll();
  mock.timers.reset();
});

for (const every of [20, 40, 80]) {
  test(`a drag of 6 mm moves the camera by 6 mm where the timer comes every ${every} ms`, () => {
    const { hand, moved, picture, sent, tick } = handAt(every);
    hand.press(/** @type {any} */ ({ button: 0, target: picture }));
    hand.drag(/** @type {any} */ ({ movementX: -200, movementY: 0 }));
    for (let i = 0; i < 30; i++) tick();
    assert.ok(Math.abs(moved.right - 200 * MM_PER_PX) < 0.01 && moved.down === 0, `${moved.right} mm`);
    for (const [type, { hand: of, camera_x: x, camera_y: y }] of sent) assert.ok(type === "axes" && of === "picture" && Math.hypot(x, y) <= 1 + 1e-9);
    assert.deepEqual(sent.at(-1)?.[1], { hand: "picture", camera_x: 0, camera_y: 0, insert: 0 });
    hand.release();
    assert.equal(hand.timer, undefined);
  });
}

test("a drag moves the camera by its size where the timer is late now and then", () => {
  const { hand, moved, picture, tick } = handAt(20);
  hand.press(/** @type {any} */ ({ button: 0, target: picture }));
  hand.drag(/** @type {any} */ ({ movementX: 120, movementY: -80 }));
  for (const late of [20, 70, 20, 20, 95, 25, 20, 60, 20]) tick(late);
  for (let i = 0; i < 30; i++) tick();
  assert.ok(Math.hypot(moved.right + 120 * MM_PER_PX, moved.down - 80 * MM_PER_PX) < 0.01, `${moved.right}, ${moved.down} mm`);
});

test("a drag begun on the black around the picture moves the camera too, and one on what lies over it does not", () => {
  const { hand, moved, pane, captured, tick } = handAt(20);
  const drag = (/** @type {unknown} */ target) => {
    hand.press(/** @type {any} */ ({ button: 0, target, pointerId: 7 }));
    hand.drag(/** @type {any} */ ({ movementX: -50, movementY: 0 }));
    for (let i = 0; i < 20; i++) tick();
    hand.release();
  };
  drag({});
  assert.deepEqual([moved.right, captured], [0, []]);
  drag(pane);
  assert.ok(Math.abs(moved.right - 50 * MM_PER_PX) < 0.01, `${moved.right} mm`);
  assert.deepEqual(captured, [7]);
});

test("letting go is the clutch: what is left of a drag is not moved", () => {
  const { hand, moved, picture, sent, tick } = handAt(20);
  hand.press(/** @type {any} */ ({ button: 0, target: picture }));
  hand.drag(/** @type {any} */ ({ movementX: -200, movementY: 0 }));
  for (let i = 0; i < 4; i++) tick();
  hand.release();
  assert.deepEqual(sent.at(-1)?.[1], { hand: "picture", camera_x: 0, camera_y: 0, insert: 0 });
  const here = moved.right;
  for (let i = 0; i < 5; i++) tick();
  assert.ok(moved.right === here && here > 1 && here < 4);
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
