import assert from "node:assert/strict";
import { afterEach, mock, test } from "node:test";
import { CameraHand, MM_PER_PX } from "../../app/web/js/endoscope/camera-hand.js";
import { arcOf } from "../../app/web/js/endoscope/guidance-arc.js";

/** A hand in a picture of 480 pixels whose timer comes when the test says so, and what it sent. */
function aHand() {
  /** @type {[string, any][]} */
  const sent = [];
  /** @type {number[]} */
  const captured = [];
  let now = 0;
  const state = { rehearsal: { state: "running", mine: true }, snake: { depth_mm: 100, length_mm: 800, insertion_mm_per_s: 20, camera_mm_per_s: 30 } };
  const connection = { state, send: (/** @type {string} */ type, /** @type {any} */ message) => sent.push([type, message]) };
  mock.method(performance, "now", () => now);
  mock.timers.enable({ apis: ["setInterval"] });
  const picture = { clientWidth: 480 };
  /** @type {Record<string, (event: any) => void>} */
  const heard = {};
  const pane = { addEventListener: (/** @type {string} */ name, /** @type {any} */ listener) => { heard[name] = listener; }, classList: { toggle() {} }, setPointerCapture: (/** @type {number} */ id) => captured.push(id) };
  globalThis.window = /** @type {any} */ ({ addEventListener() {} });
  /** @type {boolean[]} */
  const holds = [];
  const hand = new CameraHand(/** @type {any} */ (pane), /** @type {any} */ (picture), /** @type {any} */ (connection), /** @type {any} */ ({ hold: (/** @type {string} */ what, /** @type {boolean} */ on) => holds.push(what === "scope" && on) }));
  hand.follow(/** @type {any} */ (state), true);
  const drags = () => sent.filter(([type]) => type === "camera.drag").map(([, message]) => message);
  return {
    hand, sent, drags, pane, picture, captured, holds, state,
    press: (/** @type {object} */ fields = {}) => heard.pointerdown({ button: 0, target: picture, pointerId: 1, clientX: 300, clientY: 200, ...fields }),
    move: (/** @type {number} */ right, /** @type {number} */ down, pointerId = 1) => heard.pointermove({ pointerId, clientX: 300 + right, clientY: 200 + down }),
    up: (pointerId = 1) => heard.pointerup({ pointerId }),
    wheel: (/** @type {number} */ deltaY) => heard.wheel({ deltaMode: 0, deltaY, preventDefault() {} }),
    tick: (ms = 20) => { now += ms; mock.timers.tick(ms); },
  };
}

afterEach(() => {
  mock.restoreAll();
  mock.timers.reset();
});

for (const moves of [1, 4, 100]) {
  test(`a drag in ${moves} moves of the pointer ends at the same way of the camera`, () => {
    const { drags, press, move, tick } = aHand();
    press();
    assert.deepEqual(drags(), [{ right_mm: 0, down_mm: 0, held: true }]);
    for (let i = 1; i <= moves; i++) {
      move((-200 * i) / moves, (120 * i) / moves);
      if (i % 3 === 0) tick();
    }
    for (let i = 0; i < 10; i++) tick();
    const { right_mm: right, down_mm: down, held } = drags().at(-1);
    assert.ok(held && Math.hypot(right - 200 * MM_PER_PX, down + 120 * MM_PER_PX) < 1e-9, `${right}, ${down} mm`);
    assert.ok(drags().length < 60, "no message for each move of a fast mouse");
  });
}

test("a drag that is held still is told again, and no more often than is needed", () => {
  const { drags, press, move, tick } = aHand();
  press();
  move(10, 0);
  for (let i = 0; i < 50; i++) tick();
  const told = drags().length;
  assert.ok(told >= 12 && told <= 15, `${told} messages in a second`);
});

test("letting go is the clutch: it is told at once, and nothing after it", () => {
  const { hand, drags, press, move, up, tick, holds } = aHand();
  press();
  move(-200, 0);
  tick();
  move(-300, 0);
  up();
  assert.equal(drags().at(-1).held, false);
  assert.equal(hand.timer, undefined);
  assert.deepEqual(holds, [true, false]);
  const told = drags().length;
  move(-400, 0);
  for (let i = 0; i < 5; i++) tick();
  assert.equal(drags().length, told);
});

test("another finger neither moves nor ends a drag", () => {
  const { drags, press, move, up, tick } = aHand();
  press();
  move(50, 0, 2);
  up(2);
  tick(100);
  assert.deepEqual(drags().at(-1), { right_mm: 0, down_mm: 0, held: true });
});

test("a robot that is no longer driven here ends the drag", () => {
  const { hand, drags, press, move, state } = aHand();
  press();
  move(50, 0);
  state.rehearsal.state = "paused";
  hand.follow(/** @type {any} */ (state), true);
  assert.equal(drags().at(-1).held, false);
  assert.equal(hand.timer, undefined);
});

test("a drag begun on the black around the picture moves the camera too, and one on what lies over it does not", () => {
  const { drags, press, pane, captured } = aHand();
  press({ target: {} });
  assert.deepEqual([drags(), captured], [[], []]);
  press({ target: pane, pointerId: 7 });
  assert.equal(drags().length, 1);
  assert.deepEqual(captured, [7]);
});

test("the wheel inserts towards a depth, beside a drag, and nothing on a fixed base", () => {
  const { sent, press, up, wheel, tick, state, holds } = aHand();
  const depths = () => sent.filter(([type]) => type === "insert.to").map(([, message]) => message);
  wheel(-100);
  assert.deepEqual(depths(), [{ depth_mm: 105, held: true }]);
  press();
  up();
  for (let i = 0; i < 10; i++) tick();
  assert.deepEqual(depths().at(-1), { depth_mm: 105, held: true }, "the end of a drag stops no wheel");
  assert.ok(depths().length >= 3 && depths().length <= 4, `${depths().length} messages in 0.2 s: told again, and no more often than is needed`);
  wheel(-100);
  assert.deepEqual(depths().at(-1), { depth_mm: 110, held: true }, "the next notch goes on from the depth that is wanted");
  state.snake.depth_mm = 110;
  tick();
  assert.deepEqual(depths().at(-1), { depth_mm: 110, held: false });
  assert.deepEqual(holds, [true, false]);
  Object.assign(state.snake, { fixed: true });
  const told = sent.length;
  wheel(-100);
  tick();
  assert.equal(sent.length, told);
});

test("a depth that a held robot does not come nearer to is given up after 1.5 s, and when the hand is gone", () => {
  const { hand, sent, wheel, tick, state } = aHand();
  const depths = () => sent.filter(([type]) => type === "insert.to").map(([, message]) => message);
  wheel(100);
  for (let i = 0; i < 60; i++) {
    state.snake.depth_mm = Math.max(98, 100 - 0.1 * i);
    tick();
  }
  assert.deepEqual(depths().at(-1), { depth_mm: 95, held: true });
  for (let i = 0; i < 60; i++) tick();
  assert.deepEqual(depths().at(-1), { depth_mm: 95, held: false });
  assert.equal(hand.timer, undefined);
  wheel(-100);
  hand.stop();
  assert.deepEqual(depths().at(-1), { depth_mm: 103, held: false });
});

test("a page that hung gives up no depth: it heard of no way that the robot came", () => {
  const { hand, sent, wheel, tick } = aHand();
  wheel(100);
  tick();
  for (let i = 0; i < 3; i++) tick(2000);
  assert.equal(sent.some(([, { held }]) => !held), false);
  hand.stop();
});

test("an arc is nothing below 0.2 N, amber from there on, and red from 2 N", () => {
  assert.equal(arcOf(0.19), null);
  assert.equal(arcOf(NaN), null);
  assert.equal(arcOf(0.2)?.red, false);
  assert.equal(arcOf(1.99)?.red, false);
  assert.equal(arcOf(2)?.red, true);
  assert.ok((arcOf(1)?.half ?? 0) > (arcOf(0.3)?.half ?? 0));
});
