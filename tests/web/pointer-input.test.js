// What a click on a point or target in a slice sends.
import assert from "node:assert/strict";
import { test } from "node:test";
import { PointerInput } from "../../app/web/js/slices/pointer-input.js";
import { noted } from "./page.js";

const point = { id: "P1", position: [0, 0, 0] }, target = { id: "T1", position: [9, 0, 0] };

/** What is sent once a press on an item has ended without a move. */
const clicked = (/** @type {any} */ item, /** @type {any} */ plan, adds = true) => {
  const connection = noted();
  const stage = { addEventListener() {} };
  const input = new PointerInput(/** @type {any} */ ({ stage, board: { connection, adds, state: { plan } } }));
  input.grab = /** @type {any} */ ({ mode: "cross", item, dragging: false });
  input.lifted(/** @type {any} */ ({}));
  return connection.sent;
};

test("while clicks add points, a click on a target leads the path there", (context) => {
  context.mock.timers.enable({ apis: ["setTimeout"] });
  const plan = { add_mode: "point", points: [point], targets: [target] };
  const all = [
    clicked(target, plan), clicked(point, plan), clicked(target, { ...plan, points: [] }), clicked(target, { ...plan, add_mode: "target" }), clicked(target, plan, false),
  ];
  context.mock.timers.tick(1000);
  assert.deepEqual(all, [[["pick.slice", { position: target.position }]], [], [], [], []]);
});

test("a press whose pointer is lost is let go, and a stroke ends", () => {
  const stage = new EventTarget();
  let ended = 0;
  const input = new PointerInput(/** @type {any} */ ({ stage, board: { painting: { end: () => { ended += 1; } } } }));
  input.listen(/** @type {any} */ (stage));
  for (const end of ["lostpointercapture", "pointercancel"]) {
    input.grab = /** @type {any} */ ({ mode: "paint" });
    stage.dispatchEvent(new Event(end));
    assert.equal(input.grab, null);
  }
  assert.equal(ended, 2);
});
