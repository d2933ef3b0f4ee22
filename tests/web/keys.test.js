import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { Keys, letGoOfEverything, ownsSpace } from "../../app/web/js/keys.js";
import { watchTyping } from "../../app/web/js/fields.js";
import { keyEvent, layOutPage, noted } from "./page.js";

let page;
beforeEach(() => { page = layOutPage(); });

const RUNNING = { step: { input: "drive" }, rehearsal: { state: "running", mine: true } };

function rehearsing() {
  const connection = noted({ step: { input: "drive" } });
  return { connection, keys: new Keys(connection) };
}

/** What an event of a key has, to be laid on one that is dispatched. */
const keyFields = (code) => ({ code, key: code, repeat: false, ctrlKey: false, metaKey: false, altKey: false, shiftKey: false });

/** Let the events that wait be handled, and the timers behind them. */
const handled = () => new Promise((go) => { setTimeout(go, 5); });

/** When an event happened so many milliseconds ago. */
const ago = (ms) => ({ timeStamp: performance.now() - ms });

test("held keys drive until they come up", () => {
  const { connection, keys } = rehearsing();
  keys.down(keyEvent("ArrowUp"));
  assert.deepEqual(connection.sent, [["drive", { direction: 1 }], ["twist", { direction: 0 }]]);
  keys.up(keyEvent("ArrowUp"));
  assert.deepEqual(connection.sent.slice(2), [["drive", { direction: 0 }], ["twist", { direction: 0 }]]);
});

test("a repeat of a held key is a press, once the events that wait were handled", async () => {
  const { connection, keys } = rehearsing();
  keys.down(keyEvent("ArrowUp"));
  keys.down(keyEvent("ArrowUp", { repeat: true }));
  assert.equal(connection.sent.length, 2);
  await handled();
  assert.deepEqual(connection.sent.slice(2), [["drive", { direction: 1 }], ["twist", { direction: 0 }]]);
  assert.deepEqual(connection.holds, [true]);
});

test("a release among the events that wait wins over repeats and over a press that comes late", async () => {
  for (const events of [[{}, { repeat: true }, { repeat: true }], [ago(300)], [ago(300), { repeat: true }]]) {
    const { connection, keys } = rehearsing();
    for (const fields of events) keys.down(keyEvent("ArrowUp", fields));
    const before = connection.sent.length;
    keys.up(keyEvent("ArrowUp"));
    await handled();
    const driven = connection.sent.slice(before).filter(([type, { direction }]) => type === "drive" && direction);
    assert.deepEqual(driven, []);
    assert.deepEqual(connection.holds, [true, false]);
  }
});

test("a burst of old repeats moves nothing", async () => {
  const { connection, keys } = rehearsing();
  for (const ms of [900, 500, 101]) keys.down(keyEvent("ArrowUp", { repeat: true, ...ago(ms) }));
  await handled();
  assert.deepEqual([connection.sent, connection.holds], [[], []]);
});

test("a press that comes late drives when nothing released it", async () => {
  const { connection, keys } = rehearsing();
  keys.down(keyEvent("ArrowUp", ago(300)));
  assert.deepEqual(connection.sent, []);
  assert.deepEqual(connection.holds, [true]); // drawing makes way for the repeats
  await handled();
  assert.deepEqual(connection.sent[0], ["drive", { direction: 1 }]);
});

test("the age of a key in the scene is told by the clock of its frame", async () => {
  const { connection, keys } = rehearsing();
  const view = { performance: { now: () => 1000 } }; // it was made later than the page
  keys.down(keyEvent("ArrowUp", { view, timeStamp: 950 }));
  assert.equal(connection.sent.length, 2);
  keys.down(keyEvent("ArrowUp", { view, timeStamp: 850, repeat: true }));
  await handled();
  assert.equal(connection.sent.length, 2);
});

test("opposite keys lead nowhere, and two of one direction no faster than one", () => {
  const { connection, keys } = rehearsing();
  const driven = () => connection.sent.filter(([type]) => type === "drive").at(-1)[1].direction;
  keys.down(keyEvent("ArrowUp"));
  keys.down(keyEvent("KeyW"));
  assert.equal(driven(), 1);
  keys.down(keyEvent("ArrowDown"));
  keys.down(keyEvent("KeyS"));
  assert.equal(driven(), 0);
  keys.up(keyEvent("ArrowUp"));
  keys.up(keyEvent("KeyW"));
  assert.equal(driven(), -1);
});

test("where a hand in the picture turns the camera, arrows turn it to four sides, and W and S alone insert", () => {
  const connection = noted({ ...RUNNING, scope: { hand: true } });
  const keys = new Keys(connection);
  const after = (code) => {
    connection.sent.length = 0;
    keys.drives(keyEvent(code));
    const sent = connection.sent.map(([type, { direction }]) => `${type} ${direction}`);
    keys.up(keyEvent(code));
    return sent;
  };
  assert.deepEqual(after("ArrowUp"), ["drive 0", "twist 0", "tilt 1"]);
  assert.deepEqual(after("ArrowDown"), ["drive 0", "twist 0", "tilt -1"]);
  for (const code of ["ArrowLeft", "KeyA"]) assert.deepEqual(after(code), ["drive 0", "twist -1", "tilt 0"]);
  for (const code of ["ArrowRight", "KeyD"]) assert.deepEqual(after(code), ["drive 0", "twist 1", "tilt 0"]);
  assert.deepEqual(after("KeyW"), ["drive 1", "twist 0", "tilt 0"]);
  assert.deepEqual(after("KeyS"), ["drive -1", "twist 0", "tilt 0"]);
  assert.deepEqual(connection.sent.at(-1), ["tilt", { direction: 0 }]);
  const slider = { target: { tagName: "INPUT", type: "range" } };
  assert.deepEqual(["ArrowLeft", "ArrowRight", "ArrowUp"].map((code) => keys.drives(keyEvent(code, slider))), [false, false, true]);
});

test("the heartbeat runs as long as anything is held", () => {
  const { connection, keys } = rehearsing();
  keys.down(keyEvent("ArrowUp"));
  keys.hold("pointer", true);
  keys.up(keyEvent("ArrowUp"));
  assert.deepEqual(connection.holds, [true]);
  keys.hold("pointer", false);
  assert.deepEqual(connection.holds, [true, false]);
});

test("what is held is let go of when the window is left", () => {
  const { connection, keys } = rehearsing();
  keys.down(keyEvent("ArrowDown"));
  keys.down(keyEvent("KeyD"));
  page.window.dispatchEvent(new Event("pagehide"));
  assert.deepEqual(connection.sent.slice(-2), [["drive", { direction: 0 }], ["twist", { direction: 0 }]]);
  assert.deepEqual(connection.holds, [true, false]);
  letGoOfEverything(); // nothing is held any more: nothing is said twice
  assert.equal(connection.sent.length, 6);
});

test("the focus that goes into the scene lets go of nothing", async () => {
  const { connection, keys } = rehearsing();
  keys.down(keyEvent("ArrowUp"));
  page.document.activeElement = { id: "scene" };
  page.window.dispatchEvent(new Event("blur"));
  await Promise.resolve();
  assert.deepEqual(connection.holds, [true]);
  page.document.hasFocus = () => false;
  page.window.dispatchEvent(new Event("blur"));
  await Promise.resolve();
  assert.deepEqual(connection.holds, [true, false]);
});

test("typing drives nothing, but the arrows drive over a slider", () => {
  const { connection, keys } = rehearsing();
  keys.down(keyEvent("KeyW", { target: { tagName: "INPUT", type: "text" } }));
  assert.deepEqual(connection.sent, []);
  keys.down(keyEvent("ArrowUp", { target: { tagName: "INPUT", type: "range" } }));
  assert.deepEqual(connection.sent[0], ["drive", { direction: 1 }]);
});

test("a slider keeps the keys that move it, and leaves the letters to the page", () => {
  const { keys } = rehearsing();
  const asked = [];
  keys.shortcut = (event) => asked.push(event.code) > 0;
  for (const code of ["ArrowLeft", "Home", "PageUp", "KeyE", "Space"]) keys.down(keyEvent(code, { target: { tagName: "INPUT", type: "range" } }));
  keys.down(keyEvent("KeyE", { target: { tagName: "INPUT", type: "number" } }));
  assert.deepEqual(asked, ["KeyE", "Space"]);
});

test("while the robot runs, text keeps its keys and a list its arrows; W and S drive in a list, and so do all keys elsewhere", () => {
  const driven = (code, target) => {
    const connection = noted(RUNNING);
    new Keys(connection).drives(keyEvent(code, { target }));
    return connection.sent.length > 0;
  };
  for (const target of [{ tagName: "INPUT", type: "text" }, { tagName: "INPUT", type: "number" }, { tagName: "TEXTAREA" }, { tagName: "DIV", isContentEditable: true }]) {
    for (const code of ["ArrowUp", "KeyW"]) assert.equal(driven(code, target), false);
  }
  for (const target of [{ tagName: "SELECT" }, { tagName: "INPUT", type: "radio" }]) {
    assert.equal(driven("ArrowUp", target), false);
    for (const code of ["KeyW", "KeyS"]) assert.equal(driven(code, target), true);
  }
  for (const target of [null, { tagName: "DIV" }, { tagName: "INPUT", type: "range" }, { tagName: "INPUT", type: "checkbox" }, { tagName: "BUTTON" }]) {
    for (const code of ["ArrowUp", "ArrowDown", "KeyW", "KeyS", "KeyA", "KeyD"]) assert.equal(driven(code, target), true);
  }
});

test("while the robot runs, no part of the page has the drive keys before", () => {
  const captured = [];
  page.window.addEventListener = (kind, listener, options) => { if (kind === "keydown" && options?.capture) captured.push(listener); };
  const connection = noted(RUNNING);
  new Keys(connection);
  const event = keyEvent("ArrowUp");
  for (const listener of captured) listener(event);
  assert.deepEqual([event.stopped, event.prevented, connection.sent.length], [true, true, 2]);
});

test("a drive key of one who watches, or of a robot that stands, is left to the part that has the focus", () => {
  for (const rehearsal of [{ state: "running", mine: false }, { state: "paused", mine: true }]) {
    const event = keyEvent("ArrowUp");
    assert.equal(new Keys(noted({ step: { input: "drive" }, rehearsal })).drives(event), false);
    assert.equal(event.stopped, false);
  }
});

test("keys do not drive behind a dialog", () => {
  for (const state of [RUNNING, { step: { input: "drive" } }]) {
    const connection = noted(state);
    page.document.querySelector = () => ({});
    new Keys(connection).down(keyEvent("ArrowUp"));
    assert.deepEqual(connection.sent, []);
  }
});

test("letters are those that the keys say, where they say Latin ones; W, A, S and D are places", () => {
  const sent = (code, key, fields) => {
    const connection = noted({ step: { input: "edit" }, plan: { ghost: null } });
    new Keys(connection).down(keyEvent(code, { key, ctrlKey: true, ...fields }));
    return connection.sent.map(([type]) => type);
  };
  assert.deepEqual(sent("KeyY", "z"), ["undo"]); // QWERTZ
  assert.deepEqual(sent("KeyZ", "y"), ["redo"]);
  assert.deepEqual(sent("KeyW", "z"), ["undo"]); // AZERTY
  assert.deepEqual(sent("KeyZ", "w"), []);
  assert.deepEqual(sent("KeyZ", "я"), ["undo"]);
  assert.deepEqual(sent("KeyZ", "Z", { shiftKey: true }), ["redo"]);
  const { connection, keys } = rehearsing();
  keys.down(keyEvent("KeyW", { key: "z" }));
  assert.deepEqual(connection.sent[0], ["drive", { direction: 1 }]);
});

test("keys drive in Rehearse only, and not with a modifier", () => {
  const connection = noted({ step: { input: "edit" } });
  new Keys(connection).down(keyEvent("ArrowUp"));
  const other = rehearsing();
  other.keys.down(keyEvent("KeyW", { ctrlKey: true }));
  assert.deepEqual([...connection.sent, ...other.connection.sent], []);
});

test("Plan: Enter ends what is being drawn, whatever else waits", () => {
  const connection = noted({ step: { input: "edit" }, plan: { ghost: { kind: "point" } }, regions: { drawing: { places: [[0, 0, 0]] } } });
  const keys = new Keys(connection);
  keys.down(keyEvent("Enter", { key: "Enter" }));
  connection.state.regions.drawing = { places: [] };
  keys.down(keyEvent("Enter", { key: "Enter" }));
  assert.deepEqual(connection.sent, [["region.done"], ["ghost.confirm"]]);
});

test("Plan: undo, redo, and the ghost", () => {
  const connection = noted({ step: { input: "edit" }, plan: { ghost: null, selected: "p1" } });
  const keys = new Keys(connection);
  const press = (code, fields) => {
    const event = keyEvent(code, fields);
    keys.down(event);
    return event;
  };
  assert.equal(press("KeyZ", { ctrlKey: true }).prevented, true);
  press("KeyZ", { metaKey: true, shiftKey: true });
  press("KeyY", { ctrlKey: true });
  press("Delete");
  connection.state.plan.ghost = { kind: "point" };
  press("Enter");
  press("Enter", { target: { tagName: "BUTTON" } }); // the button's own business
  press("Delete");
  press("Escape");
  assert.deepEqual(connection.sent, [["undo"], ["redo"], ["redo"], ["item.delete", { item_id: "p1" }], ["ghost.confirm"], ["ghost.cancel"], ["ghost.cancel"]]);
});

test("a key in the scene's frame does not reach the viewer's own hot keys", () => {
  const { keys } = rehearsing();
  const event = keyEvent("KeyG", { view: {} });
  keys.down(event);
  assert.equal(event.stopped, true);
});

test("undo is the plan's while a list has the focus, and the text's in a field", () => {
  const connection = noted({ step: { name: "plan", input: "edit" } });
  const keys = new Keys(connection);
  keys.down(keyEvent("KeyZ", { ctrlKey: true, target: { tagName: "SELECT" } }));
  assert.deepEqual(connection.sent, [["undo"]]);
  keys.down(keyEvent("KeyZ", { ctrlKey: true, target: { tagName: "INPUT", type: "number" } }));
  keys.down(keyEvent("ArrowDown", { target: { tagName: "SELECT" } }));
  assert.equal(connection.sent.length, 1);
});

test("undo is the planner's in a field that shows what the planner has, and the text's while it is typed in", () => {
  const connection = noted({ step: { name: "plan", input: "edit" } });
  const keys = new Keys(connection);
  const field = Object.assign(new EventTarget(), { tagName: "INPUT", type: "text", value: "1", dataset: {}, getAttribute: () => null });
  watchTyping(field);
  page.document.activeElement = field;
  const type = (value) => {
    field.dispatchEvent(new Event("beforeinput"));
    field.value = value;
    field.dispatchEvent(new Event("input"));
  };
  const undo = () => keys.down(keyEvent("KeyZ", { ctrlKey: true, target: field }));
  type("12");
  undo();
  assert.deepEqual(connection.sent, []);
  field.dispatchEvent(new Event("change")); // Enter: the field keeps the focus
  undo();
  assert.deepEqual(connection.sent, [["undo"]]);
  type("123");
  type("12"); // taken back to what stood there
  undo();
  assert.equal(connection.sent.length, 2);
});

test("a slider has no undo of its own, and in a question undo is the text's", () => {
  const connection = noted({ step: { name: "plan", input: "edit" } });
  const keys = new Keys(connection);
  keys.down(keyEvent("KeyZ", { ctrlKey: true, target: { tagName: "INPUT", type: "range" } }));
  assert.deepEqual(connection.sent, [["undo"]]);
  page.document.querySelector = () => ({});
  keys.down(keyEvent("KeyZ", { ctrlKey: true, target: { tagName: "SELECT" } }));
  assert.equal(connection.sent.length, 1);
});

test("Escape folds an open explanation first, and takes back nothing of the plan with it", () => {
  const connection = noted({ step: { input: "edit" }, plan: { ghost: {} } });
  const keys = new Keys(connection);
  let open = true;
  let focused = 0;
  const folded = { checkVisibility: () => false }; // in a step that is closed
  const explanation = { checkVisibility: () => true, removeAttribute: () => { open = false; }, querySelector: () => ({ focus: () => { focused += 1; } }) };
  page.document.querySelectorAll = (selector) => (selector === "details.more[open]" ? [folded, ...(open ? [explanation] : [])] : []);
  keys.down(keyEvent("Escape"));
  assert.deepEqual([open, focused, connection.sent], [false, 1, []]);
  keys.down(keyEvent("Escape"));
  assert.deepEqual(connection.sent, [["ghost.cancel"]]);
});

test("a box or a button that was clicked leaves Space to the page, until Tab gives it the focus; text keeps it", () => {
  const { window } = page;
  rehearsing();
  const focused = (selector) => ({ target: { closest: (selectors) => (selectors.split(", ").includes(selector) ? {} : null) } });
  const box = focused("input[type=checkbox]"), button = focused("button"), text = focused("[contenteditable]");
  const owned = () => [box, button, text].map(ownsSpace);
  const happens = (name, fields = {}) => window.dispatchEvent(Object.assign(new Event(name), fields));
  happens("keydown", keyFields("Tab"));
  happens("focusin");
  assert.deepEqual(owned(), [true, true, true]);
  happens("pointerdown");
  happens("focusin");
  assert.deepEqual(owned(), [false, false, true]);
  happens("keydown", keyFields("Space"));
  assert.deepEqual(owned(), [false, false, true]);
  happens("keydown", keyFields("Tab"));
  happens("focusin");
  assert.deepEqual(owned(), [true, true, true]);
});
