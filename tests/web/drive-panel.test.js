// Drive: the keys of a robot in a lumen.
import assert from "node:assert/strict";
import { test } from "node:test";
import { keyEvent } from "./page.js";
import { connectionOf, layOutElements } from "./panels.js";

layOutElements();
Object.assign(globalThis, { localStorage: { getItem: () => null, setItem() {} } });
Object.defineProperty(globalThis, "navigator", { value: {}, configurable: true });
const { default: DrivePanel } = await import("../../app/tabs/drive/panel.js");

/** A window whose robot runs in the manual arm. */
function driving() {
  const state = { step: { name: "drive", input: "drive" }, rehearsal: { state: "running", mine: true }, snake: { arm: "manual", joint: 1 } };
  const connection = connectionOf(state), panel = new DrivePanel({ connection, keys: { hold() {}, shortcuts: [] } });
  const key = (code, fields) => panel.key(keyEvent(code, fields));
  return { panel, state, key, sent: () => connection.sent.splice(0) };
}

/** What has the focus, by the selectors that fit it. */
const focused = (...fit) => ({ closest: (selectors) => selectors.split(", ").find((one) => fit.includes(one)) ?? null });

test("Space pauses, and a control that has the focus keeps it", () => {
  const { key, sent } = driving();
  for (const fit of ["button", "select", "summary", "input:not([type=range])", "[contenteditable]"]) assert.equal(key("Space", { target: focused(fit) }), false, fit);
  assert.equal(key("Space", { repeat: true }), false, "a key that is held is pressed once");
  assert.deepEqual(sent(), []);
  assert.equal(key("Space"), true);
  assert.equal(key("Space", { target: focused("div") }), true);
  assert.deepEqual(sent(), [["rehearsal.pause"], ["rehearsal.pause"]]);
});

test("J changes the joint in the window that drives, also while a button has the focus", () => {
  const { state, key, sent } = driving();
  assert.equal(key("KeyJ", { target: focused("button") }), true);
  assert.deepEqual(sent(), [["drive.joint", { joint: 2 }]]);
  state.rehearsal.mine = false;
  assert.equal(key("KeyJ"), false, "whoever watches has no joint to change");
  assert.equal(key("Space"), true, "but may pause");
  assert.deepEqual(sent(), [["rehearsal.pause"]]);
});
