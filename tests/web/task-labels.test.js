// Labels of study II in the picture, the marker on them, and the button of the tool.
import assert from "node:assert/strict";
import { mock, test } from "node:test";
import { COLOURS, HALF_MM, RADIUS_MM, labelTriangles } from "../../app/web/js/endoscope/task-labels.js";
import { keyEvent, noted } from "./page.js";
import { layOutElements } from "./panels.js";

layOutElements();
const { ToolButton } = await import("../../app/tabs/drive/tool-button.js");

const LABEL = { centre: [10, 20, 30], normal: [0, 0, 1], along: [1, 0, 0], end_mm: -10 };
/** Corners of a colour, as places. */
const corners = (all, [red]) => {
  const found = [];
  for (let at = 0; at < all.length; at += 9) if (Math.abs(all[at + 6] - red) < 1e-6) found.push([all[at], all[at + 1], all[at + 2]]);
  return found;
};

test("a label is a disc about its middle, and its arrow ends at its tip", () => {
  const all = labelTriangles([LABEL]);
  const paper = corners(all, COLOURS.paper).map(([x, y]) => Math.hypot(x - 10, y - 20));
  assert.ok(Math.abs(Math.max(...paper) - RADIUS_MM) < 1e-4);
  const rim = corners(all, COLOURS.rim).map(([x, y]) => Math.hypot(x - 10, y - 20));
  assert.ok(Math.min(...rim) > 0.9 * RADIUS_MM && Math.max(...rim) < RADIUS_MM + 1e-4);
  const arrow = corners(all, COLOURS.ink).map(([x]) => x - 10);
  assert.deepEqual([Math.min(...arrow), Math.max(...arrow)], [-HALF_MM, HALF_MM]);
});

test("the object reaches from its aimed end to the arrow's tip, and is gone at its end", () => {
  for (const end of [-10, 0, 7.5]) {
    const object = corners(labelTriangles([{ ...LABEL, end_mm: end }]), COLOURS.object).map(([x]) => x - 10);
    assert.deepEqual([Math.min(...object), Math.max(...object)], [end, HALF_MM]);
  }
  assert.equal(corners(labelTriangles([{ ...LABEL, end_mm: 10 }]), COLOURS.object).length, 0);
  assert.equal(corners(labelTriangles([{ ...LABEL, end_mm: 10 }]), COLOURS.paper).length, 0, "its paper has the colour of what is done");
  assert.ok(corners(labelTriangles([{ ...LABEL, end_mm: 10 }]), COLOURS.done).length);
});

test("X holds the button of the tool while there is one, and everything lets go of it", () => {
  const connection = noted(), keys = { shortcuts: [], holds: [], hold: (what, on) => keys.holds.push([what, on]) };
  const button = new ToolButton(connection, keys), press = () => keys.shortcuts[0](keyEvent("KeyX"));
  assert.equal(press(), false);
  button.follow(true);
  assert.equal(press(), true);
  assert.equal(press(), true, "a repeat");
  globalThis.window.dispatchEvent(Object.assign(new Event("keyup"), { code: "KeyX" }));
  press();
  button.follow(false);
  assert.deepEqual(connection.sent, [["drive.cut", { on: true }], ["drive.cut", { on: false }], ["drive.cut", { on: true }], ["drive.cut", { on: false }]]);
  assert.deepEqual(keys.holds.map(([, on]) => on), [true, false, true, false]);
});

test("a repeat of X or a motion with the button down tells it again, not too often, and not what is heard late", () => {
  const connection = noted(), keys = { shortcuts: [], hold() {} };
  const button = new ToolButton(connection, keys);
  let now = 1000;
  mock.method(performance, "now", () => now);
  button.follow(true);
  const press = (fields = {}) => keys.shortcuts[0](keyEvent("KeyX", fields));
  press();
  for (let i = 0; i < 10; i++) {
    now += 33; // as keyboards repeat
    press({ repeat: true });
  }
  assert.equal(connection.sent.length, 4);
  now += 400;
  press({ repeat: true, timeStamp: now - 200 });
  assert.equal(connection.sent.length, 4);
  globalThis.Element ??= class {};
  const picture = Object.assign(new globalThis.Element(), { classList: { contains: () => true } });
  const move = (buttons) => globalThis.window.dispatchEvent(Object.defineProperties(new Event("pointermove"), { buttons: { value: buttons }, target: { value: picture }, view: { value: null }, timeStamp: { value: now } }));
  globalThis.window.dispatchEvent(Object.assign(new Event("keyup"), { code: "KeyX" }));
  move(2);
  now += 100;
  move(3);
  move(1);
  assert.deepEqual(connection.sent.slice(4).map(([, { on }]) => on), [false, true, true, false]);
  mock.restoreAll();
});
