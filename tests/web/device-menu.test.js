// The menu of devices: what it asks of the planner for the device that is chosen, and when a device is not read.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { noted } from "./page.js";
import { layOutElements } from "./panels.js";

const { document } = layOutElements();
const frames = [];
Object.assign(globalThis, { requestAnimationFrame: (draw) => frames.push(draw), localStorage: { getItem: () => null, setItem() {} } });
const pad = { id: "Pad X", connected: true, mapping: "standard", axes: [0, 0, 0, 0], buttons: [] };
Object.defineProperty(globalThis, "navigator", { value: { getGamepads: () => [pad] }, configurable: true });
const { DeviceMenu } = await import("../../app/tabs/rehearse/device-menu.js");

/** A window that holds the handle of a teleoperated drive that runs. */
function station(device = "position") {
  const control = { mode: "teleoperated", device, preset: null, certified: true };
  const state = { step: { name: "rehearse", input: "drive" }, rehearsal: { state: "running", mine: true, control } };
  const connection = Object.assign(new EventTarget(), noted(state), { on(name, listener) { connection.addEventListener(name, ({ detail }) => listener(detail)); } });
  const sent = () => connection.sent.splice(0);
  connection.send = (type, fields) => connection.sent.push([type, fields]);
  const menu = new DeviceMenu({ connection, keys: { hold() {}, directions: { drive: 0, twist: 0 } } });
  const says = () => connection.dispatchEvent(new CustomEvent("state", { detail: { state, changed: [] } }));
  const frame = () => { for (const draw of frames.splice(0)) draw(performance.now()); };
  menu.update(state);
  return { menu, state, control, sent, says, frame, connection };
}

beforeEach(() => {
  frames.splice(0);
  pad.axes = [0, 0, 0, 0];
});

test("Rate stays chosen with the mouse and with keys, and Position with a gamepad", () => {
  const { menu, state, control, sent } = station();
  for (const [kind, other] of [["mouse", "rate"], ["keys", "rate"], ["gamepad", "position"]]) {
    menu.choose(kind);
    menu.update(state);
    sent();
    control.device = other; // by the buttons of the mode, or in another window
    for (let again = 0; again < 3; again += 1) menu.update(state);
    assert.deepEqual(sent(), [], kind);
  }
});

test("a device that is chosen brings its kind along, once it drives a teleoperated tool", () => {
  const { menu, state, control, sent } = station();
  const asked = () => sent().map(([type, fields]) => [type, fields.device]);
  assert.deepEqual(asked(), [], "the mouse has the position, as it is");
  menu.choose("gamepad");
  for (let again = 0; again < 3; again += 1) menu.update(state);
  assert.deepEqual(asked(), [["rehearsal.control", "rate"]]);
  control.device = "rate";
  menu.update(state);
  control.mode = "hands-on";
  menu.choose("mouse");
  menu.update(state);
  assert.deepEqual(asked(), [], "it says nothing to a hand on the robot");
  control.mode = "teleoperated";
  menu.update(state);
  assert.deepEqual(asked(), [["rehearsal.control", "position"]]);
});
