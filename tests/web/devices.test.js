// Devices that a person drives with, played by fakes: what of them is sent, and that nothing is once they are gone.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { GamepadSource, axesOf } from "../../app/web/js/devices/gamepad.js";
import { RateChannel } from "../../app/web/js/devices/rate-channel.js";
import { REST, shaped } from "../../app/web/js/devices/six-axes.js";
import { SpaceMouseSource, fieldsOf } from "../../app/web/js/devices/space-mouse.js";
import { LET_GO } from "../../app/web/js/keys.js";
import { layOutPage } from "./page.js";

const { window } = layOutPage();
const frames = [];
Object.assign(globalThis, { requestAnimationFrame: (draw) => frames.push(draw) });
const { HandDevices } = await import("../../app/web/js/devices/hand-devices.js");

const usages = (first) => [0, 1, 2].map((index) => 0x10000 + first + index);
const axis = (first, size = 16, most = 350) => ({ isRange: false, usages: usages(first), reportSize: size, reportCount: 3, logicalMinimum: -most, logicalMaximum: most });
const BUTTONS = { reportId: 3, items: [{ isRange: true, usageMinimum: 0x90001, usageMaximum: 0x90002, reportSize: 1, reportCount: 2, logicalMinimum: 0, logicalMaximum: 1 }] };
const WIRED = [{ usagePage: 1, usage: 8, inputReports: [{ reportId: 1, items: [axis(0x30)] }, { reportId: 2, items: [axis(0x33)] }, BUTTONS], children: [] }];
const WIRELESS = [{ usagePage: 1, usage: 8, children: [{ inputReports: [{ reportId: 1, items: [{ ...axis(0x30), isRange: true, usages: undefined, usageMinimum: 0x10030, reportCount: 6 }] }, BUTTONS] }] }];

class FakeMouse extends EventTarget {
  vendorId = 0x256f;
  productName = "SpaceMouse Compact";
  opened = false;

  constructor(collections) {
    super();
    this.collections = collections;
  }

  async open() { this.opened = true; }

  async close() { this.opened = false; }

  report(reportId, values, timeStamp = performance.now()) {
    const data = new DataView(new ArrayBuffer(2 * values.length));
    values.forEach((value, index) => data.setInt16(2 * index, value, true));
    const event = new Event("inputreport");
    Object.defineProperties(event, { reportId: { value: reportId }, data: { value: data }, timeStamp: { value: timeStamp } });
    this.dispatchEvent(event);
  }
}

class FakeHid extends EventTarget {
  granted = [];

  constructor(mouse) {
    super();
    this.mouse = mouse;
  }

  async requestDevice() {
    this.granted = [this.mouse];
    return this.granted;
  }

  async getDevices() { return this.granted; }

  unplug() {
    this.granted = [];
    this.dispatchEvent(Object.assign(new Event("disconnect"), { device: this.mouse }));
  }
}

const buttons = (...pressed) => [...new Array(17).keys()].map((index) => ({ value: pressed.includes(index) ? 1 : 0 }));
const pad = (fields = {}) => ({ id: "Pad X (STANDARD GAMEPAD Vendor: 045e)", connected: true, mapping: "standard", axes: [0, 0, 0, 0], buttons: buttons(), ...fields });

async function opened(collections = WIRED) {
  const mouse = new FakeMouse(collections);
  const hid = new FakeHid(mouse);
  const source = new SpaceMouseSource({ hid });
  source.start();
  await source.ask();
  return { mouse, hid, source };
}

/** A channel that notes what it sends and holds. */
function noted() {
  const told = [];
  const channel = new RateChannel((axes) => told.push(axes), (on) => told.push(on));
  return { told, channel };
}

const close = (axes, wanted) => axes.forEach((value, index) => assert.ok(Math.abs(value - wanted[index]) < 1e-9, `${axes} is not ${wanted}`));

beforeEach(() => frames.splice(0));

test("the dead band is cut out, and the axis rises from 0 to 1 beyond it", () => {
  assert.deepEqual([0, 0.05, -0.05, NaN, undefined].map(shaped), [0, 0, 0, 0, 0]);
  assert.deepEqual([1, -1, 7].map(shaped), [1, -1, 1]);
  assert.ok(Math.abs(shaped(0.525) - 0.5) < 1e-9 && Math.abs(shaped(-0.525) + 0.5) < 1e-9);
});

test("a gamepad's sticks, triggers and shoulders are the six axes of the picture", () => {
  assert.deepEqual(axesOf(pad()), [...REST]);
  assert.deepEqual(axesOf(pad({ axes: [1, -1, 0, 0] })), [1, 0, 1, 0, 0, 0], "right, and forward into the picture");
  assert.deepEqual(axesOf(pad({ axes: [0, 0, -1, -1] })), [0, 0, 0, 1, -1, 0], "looks up, and left");
  assert.deepEqual(axesOf(pad({ buttons: buttons(5, 7) })), [0, -1, 0, 0, 0, 1], "up, and rolls clockwise");
  assert.deepEqual(axesOf(pad({ buttons: buttons(4, 6) })), [0, 1, 0, 0, 0, -1]);
});

test("of the gamepads the first of a known layout is read, and what is missing is said", () => {
  let pads = [null, pad({ mapping: "" })];
  const source = new GamepadSource({ getGamepads: () => pads });
  assert.deepEqual([source.name, source.trouble, source.read()], ["", "This gamepad’s layout is not known.", [...REST]]);
  pads = [null, pads[1], pad({ axes: [1, 0, 0, 0] }), null];
  assert.deepEqual([source.name, source.trouble, source.read()], ["Pad X", "", [1, 0, 0, 0, 0, 0]]);
  pads = [null, null];
  assert.deepEqual([source.trouble, source.read()], ["No gamepad. Plug one in and press a button.", [...REST]]);
  assert.equal(new GamepadSource({}).trouble, "This browser reads no gamepads.");
});

test("where the axes are stands in the device's own description", () => {
  assert.deepEqual([...fieldsOf(WIRED)].map(([report, fields]) => [report, fields.map(({ axis: number, byte }) => [number, byte])]), [[1, [[0, 0], [1, 2], [2, 4]]], [2, [[3, 0], [4, 2], [5, 4]]]]);
  assert.deepEqual([...fieldsOf(WIRELESS)].map(([report, fields]) => [report, fields.map(({ axis: number, byte }) => [number, byte])]), [[1, [0, 1, 2, 3, 4, 5].map((number) => [number, 2 * number])]]);
  const behind = [{ inputReports: [{ reportId: 1, items: [{ reportSize: 8, reportCount: 1, usages: [0xff000001], logicalMinimum: 0, logicalMaximum: 255 }, axis(0x30, 8, 127)] }] }];
  assert.deepEqual(fieldsOf(behind).get(1), [0, 1, 2].map((number) => ({ axis: number, byte: 1 + number, bytes: 1, full: 127 })));
});

test("a SpaceMouse is read in the picture's axes, whichever reports it has", async () => {
  for (const [collections, reports] of [[WIRED, [[1, [350, 0, 175]], [2, [0, -350, 350]]]], [WIRELESS, [[1, [350, 0, 175, 0, -350, 350]]]]]) {
    const { mouse, source } = await opened(collections);
    for (const [id, values] of reports) mouse.report(id, values);
    close(source.read(performance.now()), [1, shaped(0.5), 0, 0, 1, 1]);
    mouse.report(1, reports[0][1].map(() => 0));
    if (reports.length > 1) mouse.report(2, [0, 0, 0]);
    close(source.read(performance.now()), REST);
  }
});

test("a SpaceMouse that is silent or unplugged pushes nothing, and one that was heard late neither", async () => {
  const { mouse, hid, source } = await opened();
  const now = performance.now();
  mouse.report(1, [350, 0, 0], now);
  assert.equal(source.read(now + 99)[0], 1);
  assert.deepEqual(source.read(now + 101), [...REST]);
  mouse.report(1, [350, 0, 0], now - 200);
  assert.deepEqual(source.read(now), [...REST]);
  mouse.report(1, [350, 0, 0], now);
  hid.unplug();
  assert.deepEqual([source.read(now), source.name, source.trouble], [[...REST], "", "The SpaceMouse was unplugged."]);
  mouse.report(1, [350, 0, 0], now);
  assert.deepEqual(source.read(now), [...REST], "nor does one that is gone");
});

test("a browser without WebHID, and a device that is held by another program, are said", async () => {
  assert.match(new SpaceMouseSource({}).trouble, /no WebHID/);
  assert.equal(new SpaceMouseSource({}).askable, false);
  const mouse = new FakeMouse(WIRED);
  mouse.open = async () => { throw new DOMException("in use", "NetworkError"); };
  const source = new SpaceMouseSource({ hid: new FakeHid(mouse) });
  source.start();
  await source.ask();
  assert.match(source.trouble, /Another program holds/);
  assert.equal(source.askable, true);
});

test("one that was allowed before is opened by itself, unless another device is chosen meanwhile", async () => {
  const { mouse, hid, source } = await opened();
  source.stop();
  await null;
  assert.equal(mouse.opened, false);
  source.start();
  source.stop();
  await new Promise((done) => { setTimeout(done); });
  assert.equal(source.name, "");
  source.start();
  await new Promise((done) => { setTimeout(done); });
  assert.deepEqual([source.name, hid.granted.length], ["SpaceMouse Compact", 1]);
});

test("one that is chosen again while it is still being closed is open in the end", async () => {
  const { mouse, source } = await opened();
  let closed = () => {};
  mouse.close = () => new Promise((done) => { closed = () => { mouse.opened = false; done(); }; });
  source.stop();
  source.start();
  await null;
  closed();
  await new Promise((done) => { setTimeout(done); });
  assert.deepEqual([source.name, mouse.opened], ["SpaceMouse Compact", true]);
});

test("news go out 60 times a second at most, the same again before 100 ms, and rest once", () => {
  const { told, channel } = noted();
  channel.set([...REST], 0);
  for (let t = 0; t < 32; t += 4) channel.set([t / 100 + 0.1, 0, 0, 0, 0, 0], t);
  assert.deepEqual(told, [true, [0.1, 0, 0, 0, 0, 0], [0.26, 0, 0, 0, 0, 0]]);
  told.splice(0);
  for (let t = 32; t < 232; t += 16) channel.set([0.5, 0, 0, 0, 0, 0], t);
  assert.equal(told.length, 3);
  told.splice(0);
  channel.set([...REST], 240);
  channel.set([...REST], 256);
  assert.deepEqual(told, [[...REST], false]);
});

test("what lies askew when it is taken, or taken away, drives only after it was at rest", () => {
  const { told, channel } = noted();
  const pushed = [0, 0, 1, 0, 0, 0];
  channel.set(pushed, 0);
  assert.deepEqual(told, []);
  channel.set([...REST], 16);
  channel.set(pushed, 32);
  channel.letGo();
  assert.deepEqual(told, [true, pushed, [...REST], false]);
  channel.set(pushed, 64);
  assert.equal(told.length, 4);
});

/** The devices of a page with one gamepad, which is chosen. */
function page() {
  const told = [];
  const state = { pads: [pad()] };
  const devices = new HandDevices({ hold: (what, on) => told.push([what, on]) }, (axes) => told.push(axes), { getGamepads: () => state.pads });
  devices.choose("gamepad");
  const frame = () => { for (const draw of frames.splice(0)) draw(performance.now()); };
  return { told, state, devices, frame };
}

test("a gamepad is polled while this window holds the handle, drives while the robot runs, and stops once it is gone", () => {
  const { told, state, devices, frame } = page();
  frame();
  assert.equal(frames.length, 0, "nobody holds anything");
  devices.follow(true, false);
  state.pads = [pad({ axes: [0, -1, 0, 0] })];
  frame();
  assert.deepEqual([told, devices.axes[2]], [[], 1], "bars move before the robot does");
  devices.follow(true, true);
  frame();
  assert.deepEqual([told, devices.isAskew], [[], true]);
  state.pads = [pad()];
  frame();
  state.pads = [pad({ axes: [0, -1, 0, 0] })];
  frame();
  assert.deepEqual(told, [["device", true], [0, 0, 1, 0, 0, 0]]);
  state.pads = [null];
  window.dispatchEvent(new Event("gamepaddisconnected"));
  assert.deepEqual(told.slice(2), [[...REST], ["device", false]], "before the next frame");
});

test("a pause, a loss of the page and another device let go", () => {
  for (const end of [(devices) => devices.follow(true, false), () => window.dispatchEvent(new Event(LET_GO)), (devices) => devices.choose("keys")]) {
    const { told, state, devices, frame } = page();
    devices.follow(true, true);
    frame();
    state.pads = [pad({ axes: [1, 0, 0, 0] })];
    frame();
    assert.deepEqual(told, [["device", true], [1, 0, 0, 0, 0, 0]]);
    end(devices);
    frame();
    assert.deepEqual(told.slice(2), [[...REST], ["device", false]]);
  }
});

test("a push of a SpaceMouse inserts while one of its buttons is held, and moves the camera otherwise", async () => {
  const { snakeAxes } = await import("../../app/tabs/drive/axes.js");
  assert.deepEqual(snakeAxes([0.5, 0.2, 0.8, 0, 0, 0], "space-mouse"), { camera_x: 0.5, camera_y: 0.2, insert: 0 });
  assert.deepEqual(snakeAxes([0.5, 0.2, 0.8, 0, 0, 0], "space-mouse", true), { camera_x: 0, camera_y: 0, insert: 0.8 });
  assert.deepEqual(snakeAxes([0.5, -1, 0, 0.25, 0, 0], "gamepad"), { camera_x: 0.5, camera_y: -0.25, insert: 1 });
  const mouse = new FakeMouse(WIRED), source = new SpaceMouseSource({ hid: new FakeHid(mouse) });
  source.wanted = true;
  await source.use(mouse);
  const press = (bits) => mouse.report(3, [bits]);
  press(2);
  assert.equal(source.pressed, true);
  press(0);
  assert.equal(source.pressed, false);
  press(1);
  source.drop("");
  assert.equal(source.pressed, false);
});
