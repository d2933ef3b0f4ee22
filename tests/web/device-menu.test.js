// The menu of devices: what it asks of the planner for the device that is chosen, and when a device is not read.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { connectionOf, layOutElements } from "./panels.js";

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
  const connection = connectionOf(state), sent = () => connection.sent.splice(0);
  const menu = new DeviceMenu({ connection, keys: { hold() {}, directions: { drive: 0, twist: 0 } } });
  const says = () => connection.tell("state", { state, changed: [] });
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

/** The gamepad is chosen, was at rest, and is deflected. */
function deflected() {
  const now = station("rate");
  now.menu.choose("gamepad");
  now.menu.update(now.state);
  now.frame();
  pad.axes = [1, 0, 0, 0];
  now.frame();
  assert.deepEqual(now.sent().map(([type, { axes }]) => [type, axes[0]]), [["rate", 1]]);
  return now;
}

test("a device is released and not read any more once another tab is shown, or the line is lost", () => {
  const other = ({ state, says }) => { state.step = { name: "review", input: "none" }; says(); };
  const lost = ({ connection, menu, state }) => {
    connection.connected = false;
    connection.tell("link", { connected: false });
    menu.update(state); // the page draws what it knew last
  };
  for (const end of [other, lost]) {
    const now = deflected();
    end(now);
    assert.deepEqual(now.sent().map(([, { axes }]) => axes[0]), [0], "it lets go at once");
    for (const across of [0, 1]) {
      pad.axes = [across, 0, 0, 0];
      now.frame();
    }
    assert.deepEqual(now.sent(), []);
    assert.equal(frames.length, 0, "nor is it polled");
    pad.axes = [0, 0, 0, 0];
  }
});

test("a window without the focus, or hidden, is driven by no device, which has to come to rest before it drives again", () => {
  for (const away of [{ hasFocus: () => false }, { hidden: true }]) {
    const now = deflected();
    Object.assign(document, away);
    const drive = () => { for (const across of [0, 1]) { pad.axes = [across, 0, 0, 0]; now.frame(); } };
    drive();
    assert.deepEqual(now.sent().map(([, { axes }]) => axes[0]), [0]);
    drive();
    assert.deepEqual(now.sent(), []);
    assert.match(now.menu.wordsNow, /once this window has the focus/);
    Object.assign(document, { hasFocus: () => true, hidden: false });
    now.frame();
    assert.deepEqual(now.sent(), [], "askew since it was elsewhere");
    drive();
    assert.deepEqual(now.sent().map(([, { axes }]) => axes[0]), [1]);
    pad.axes = [0, 0, 0, 0];
  }
});

test("a stick that is held while mode, device or task changes drives nothing before it was at rest", () => {
  const changes = [
    ({ control }) => { control.mode = "hands-on"; },
    ({ control }) => { control.device = "position"; },
    ({ state }) => { state.rehearsal = { ...state.rehearsal, mode: "free" }; },
  ];
  for (const change of changes) {
    const now = deflected();
    change(now);
    now.says();
    const driven = () => now.sent().filter(([type]) => type === "rate").map(([, { axes }]) => axes[0]);
    assert.deepEqual(driven(), [0], "it is let go of at once");
    for (const across of [1, 0.5, 1]) {
      pad.axes = [across, 0, 0, 0];
      now.frame();
      now.says();
    }
    assert.deepEqual(driven(), []);
    assert.match(now.menu.wordsNow, /Let go of it once/);
    for (const across of [0, 1]) {
      pad.axes = [across, 0, 0, 0];
      now.frame();
    }
    assert.deepEqual(driven(), [1]);
    pad.axes = [0, 0, 0, 0];
  }
});
