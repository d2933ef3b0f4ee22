// Drive: the keys of a robot in a lumen, its devices, and what is said of its task and its run.
import assert from "node:assert/strict";
import { test } from "node:test";
import { keyEvent } from "./page.js";
import { connectionOf, layOutElements } from "./panels.js";

layOutElements();
Object.assign(globalThis, { localStorage: { getItem: () => null, setItem() {} } });
Object.defineProperty(globalThis, "navigator", { value: {}, configurable: true });
const { listenerOf } = await import("./templates.js");
const { default: DrivePanel, helpOf, tooNarrow, whyNoLook } = await import("../../app/tabs/drive/panel.js");
const { wallWords } = await import("../../app/web/js/endoscope/scope.js");
const { shortcutsIn } = await import("../../app/web/js/shortcuts.js");
const { cautions } = await import("../../app/tabs/drive/limits.js");
const { doneWords } = await import("../../app/tabs/drive/status.js");
const { taskGroup } = await import("../../app/tabs/drive/task.js");

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
  for (const fit of ["button", "select", "summary", "input[type=checkbox]", "input:not([type=range]):not([type=checkbox])", "[contenteditable]"]) assert.equal(key("Space", { target: focused(fit) }), false, fit);
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

test("a SpaceMouse that no browser has allowed yet can be asked for", () => {
  const { panel } = driving(), { spaceMouse } = panel.devices;
  let asked = 0;
  Object.assign(spaceMouse, { hid: Object.assign(new EventTarget(), { getDevices: async () => [] }), ask: () => { asked += 1; } });
  assert.doesNotMatch(panel.device(), /connect-device/);
  panel.devices.kind = "space-mouse";
  assert.match(panel.device(), /Connect SpaceMouse/);
  listenerOf('id="connect-device"', "click")();
  assert.equal(asked, 1);
  spaceMouse.device = { productName: "Compact" };
  assert.doesNotMatch(panel.device(), /connect-device/);
});

test("a task whose polyps were drawn says from how much of the wall, and how many are viewed", () => {
  const now = { of: 10, cleared: 0, held_s: 0, hold_s: 7, viewed: false, seen: null, completed: false, words: "", end_mm: 500, end_name: "ascending", viewable_share: 0.876 };
  const told = (/** @type {any} */ changed) => String(taskGroup(connectionOf({}), /** @type {any} */ ({ offered: ["polyps"], labels: null, task: "polyps", places: "route", seed: 0, marks: 2, open: true, now: { ...now, ...changed } })));
  assert.match(told({}), /Drawn from the viewable 88 % of the wall/);
  assert.doesNotMatch(told({ viewable_share: null }), /Drawn from the/);
  assert.match(told({ cleared: 3 }), /3 of 10 viewed/); // how many: the numbers in 3D are those of places, and any may come first
  assert.doesNotMatch(told({ cleared: 3 }), /Polyp 4/);
  assert.match(told({}), /None in clear view/);
  const ready = String(taskGroup(connectionOf({ rehearsal: { state: "ready" } }), /** @type {any} */ ({ offered: ["polyps"], labels: null, task: "polyps", places: "route", seed: 0, marks: 2, open: true, now })));
  assert.doesNotMatch(ready, /in clear view/); // it may well be: nothing is looked at before Start
  const seen = [[31, 5, /Too far, 31\u00a0mm/], [6, 5, /Too near, 6\u00a0mm/], [15, 27, /27° off centre/]];
  for (const [distance_mm, angle_deg, words] of seen) assert.match(told({ seen: { distance_mm, angle_deg } }), /** @type {RegExp} */ (words));
  assert.match(told({ viewed: true, held_s: 1 }), /1.0 of 7 s/);
});

test("what pauses, ends and resets a drive stands in the bar that stays in sight", () => {
  const { panel, state } = driving();
  panel.endCard.begin = async () => {};
  panel.update(state);
  const [, bar] = /<div class="panel-bar drive-bar"[^>]*>(.*?)<p/su.exec(panel.element.textContent) ?? [];
  assert.deepEqual([...bar.matchAll(/id="([a-z-]+)"/gu)].map(([, id]) => id), ["start", "finish-run", "reset"]);
  assert.match(bar, />Pause</);
  assert.equal(panel.element.textContent.match(/id="finish-run"/gu)?.length, 1);
  state.rehearsal.mine = false;
  panel.update(state);
  assert.doesNotMatch(panel.element.textContent, /finish-run/, "by the window that drives");
});

test("a figure of a link is amber from 90 % of its bound on, behind the wall as outside the pathway", () => {
  const snake = (/** @type {number} */ off, /** @type {number} */ depth, /** @type {number | null} */ bound_mm = 6) => /** @type {any} */ ({ nearest: { deviation_mm: off, bound_mm: 8 }, deepest: { depth_mm: depth, bound_mm } });
  assert.deepEqual(cautions(snake(7.1, 5.3)), { deviation: false, behind: false });
  assert.deepEqual(cautions(snake(7.3, 5.5)), { deviation: true, behind: true });
  assert.deepEqual(cautions(snake(7.1, 5.5, null)), { deviation: false, behind: false }, "a link that is out again");
  assert.deepEqual([cautions(null), cautions(/** @type {any} */ ({ nearest: null, deepest: null }))].map(({ deviation, behind }) => deviation || behind), [false, false]);
});

test("the arcs on the picture's rim are explained with their colours", () => {
  const { panel } = driving();
  assert.match(String(panel.device(null)), /thick one guides.*thin one inside it is the resistance.*class="arc-key amber">Amber: from 0\.2 N.*class="arc-key red">Red: from 2 N/su);
});

test("one more that is done ticks the count", () => {
  const now = { of: 10, cleared: 3, held_s: 0, hold_s: 7, viewed: false, seen: null, completed: false, words: "", end_mm: 500, end_name: "", viewable_share: null };
  const told = (/** @type {number} */ cleared) => String(taskGroup(connectionOf({}), /** @type {any} */ ({ offered: ["polyps"], labels: null, task: "polyps", places: "route", seed: 0, marks: 2, open: true, now: { ...now, cleared } })));
  assert.match(told(3), /<dt class=ticked>✓ 3 of 10 viewed/);
  assert.match(told(0), /<dt class=>0 of 10 viewed/);
});

test("a lens at the wall or behind it is told, with how deep", () => {
  assert.deepEqual([null, 4, 0.6, -2.14].map(wallWords), ["", "", "Lens at the wall", "Lens 2.1 mm in the wall"]);
});

test("a robot that is too thick for its route cannot start, and a thinner one is offered", () => {
  const path = /** @type {any} */ ({ state: "ready", limit: "narrow", least_mm: 5, reach_mm: 392, by_hand_mm: null, offers: [{ links: 62, length_mm: 14, radius_mm: 4, bound_mm: null }] });
  const route = /** @type {any} */ ({ radius_mm: 6, entry: [0, 0, 0], end: [0, 0, 1] });
  assert.equal(tooNarrow(path, route), path);
  assert.equal(tooNarrow({ ...path, limit: "end" }, { ...route, radius_mm: 4 }), null);
  assert.deepEqual(tooNarrow({ ...path, limit: "bound" }, route)?.limit, "bound", "what holds it before does not make it fit");
  const { panel, state, sent } = driving();
  Object.assign(state, { route, route_path: path, rehearsal: { state: "ready", mine: true } });
  assert.match(String(panel.drive(state.rehearsal, route)), /Too narrow for this robot 392 mm in: radius 5\.0 mm\./);
  assert.doesNotMatch(String(panel.drive(state.rehearsal, route)), /contour by hand/);
  state.route_path.by_hand_mm = 401;
  assert.match(String(panel.drive(state.rehearsal, route)), /The contour by hand at 401 mm does that\./);
  state.route_path.by_hand_mm = null;
  listenerOf('id="take-offer"', "click")();
  assert.deepEqual(sent(), [["route.robot", { links: 62, length_mm: 14, radius_mm: 4 }]]);
});

test("Look round says why it is off", () => {
  assert.match(whyNoLook(true, { can_look: true }), /runs/);
  assert.match(whyNoLook(false, { can_look: false }), /Insert until/);
  assert.equal(whyNoLook(false, { can_look: true }), "");
});

test("the help of a robot on a fixed base says of nothing that it inserts", () => {
  const snake = { camera_mm_per_s: 30 };
  const stands = helpOf(true, snake), inserted = helpOf(false, snake);
  assert.doesNotMatch(stands, /wheel|W S|triggers|inserts? and/i);
  for (const words of [/wheel .* inserts/i, /W S insert/, /triggers insert/]) assert.match(inserted, words);
  for (const help of [stands, inserted, helpOf(true, null)]) assert.match(help, /↑ ↓ ← → turn the camera/);
  assert.match(inserted, /30 mm\/s at most/);
});

test("the list of keys begins with those of the tab, and has all others after them", () => {
  const titles = (tab) => shortcutsIn(tab).map(([title]) => title);
  const all = titles(undefined);
  assert.equal(titles("Drive")[0], "Drive");
  assert.equal(titles("Plan")[0], "Plan");
  assert.deepEqual(titles("Drive").toSorted(), all.toSorted());
  assert.deepEqual(titles("Review"), all, "a tab without keys of its own");
  const [, keys] = shortcutsIn("Drive")[0];
  for (const key of ["W S", "↑ ↓ ← →", "Wheel", "Drag", "Space", "E"]) assert.ok(keys.some((row) => row.keys === key), key);
});

test("what counts in a task is said before anything is asked for, and how far it is in the status bar", () => {
  const now = { of: 10, cleared: 3, held_s: 0, hold_s: 5, viewed: false, seen: null, completed: false, words: "", end_mm: 500, end_name: "", viewable_share: null };
  const told = (/** @type {any} */ shown) => String(taskGroup(connectionOf({}), /** @type {any} */ ({ offered: ["polyps"], labels: null, task: "polyps", places: "route", seed: 0, marks: 0, open: true, now: shown })));
  assert.match(told(now), /3 of 10 viewed.*in the frame for 5 s, 15\s±\s7\smm away/su);
  assert.match(told(null), /in the frame for 7 s/);
  const of = (/** @type {any} */ task) => doneWords(task);
  assert.equal(of({ now, labels: null }), "3 of 10 polyps");
  assert.equal(of({ now: null, labels: { traced: 1, labels: [{}, {}] } }), "1 of 2 labels");
  assert.deepEqual([of({ now: null, labels: null }), of(undefined)], ["", ""]);
});
