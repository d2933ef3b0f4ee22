// Rehearse: the marks of a tool without the certificate, and the sliders of its settings.
import assert from "node:assert/strict";
import { test } from "node:test";
import { noted } from "./page.js";
import { connectionOf, layOutElements } from "./panels.js";

layOutElements();
Object.assign(globalThis, { localStorage: { getItem: () => null, setItem() {} } });
Object.defineProperty(globalThis, "navigator", { value: {}, configurable: true });
const { ModesGroup } = await import("../../app/tabs/rehearse/modes.js");
const { RehearsalStatus } = await import("../../app/tabs/rehearse/status.js");
const { default: RehearsePanel } = await import("../../app/tabs/rehearse/panel.js");

const settled = async () => { for (let turn = 0; turn < 50; turn += 1) await null; };
const state = (mode, certified) => ({ rehearsal: { state: "running", control: { mode, device: "position", preset: null, certified }, contacts: [] } });

test("what is shown as without the certificate is what the planner says of it, not the mode that was chosen", () => {
  for (const [mode, certified] of [["freehand", false], ["hands-on", false], ["hands-on", true], ["teleoperated", true]]) {
    const status = new RehearsalStatus(), modes = new ModesGroup(noted());
    status.update(state(mode, certified));
    modes.update(state(mode, certified), true);
    assert.equal(status.mode.element.hidden, certified, `${mode}, ${certified}`);
    assert.equal(modes.element.textContent.includes('id="uncertified"'), !certified, `${mode}, ${certified}`);
  }
});

test("a slider stays the same one, with its focus, for as long as its settings are the same ones", () => {
  const panel = new RehearsePanel({ connection: connectionOf({}), keys: { hold() {}, shortcuts: [], directions: { drive: 0, twist: 0 } } });
  const fields = (...names) => ({ words: "", fields: names.map((name) => ({ name, label: name, unit: "mm", value: 1, digits: 1, lo: 0, hi: 2, step: 1 })) });
  const shown = () => panel.fields.children.map((child) => child.children[1]);
  panel.renderFields(fields("margin_mm", "stiffness", "force"), true);
  panel.renderFields(fields("stiffness", "force"), true); // in a free hand
  const before = shown();
  panel.renderFields(fields("stiffness", "force"), true);
  assert.deepEqual([before.length, shown().every((input, index) => input === before[index])], [2, true]);
  panel.renderFields(fields("margin_mm", "stiffness"), true);
  assert.equal(shown().length, 2);
  assert.notEqual(shown()[0], before[0], "as many, but others");
});

test("with a countdown the tool is placed before it, and moves at its end", async ({ mock }) => {
  mock.timers.enable({ apis: ["setTimeout"] });
  for (const before of ["absent", "failed"]) {
    const connection = connectionOf({ rehearsal: { state: before } }), keys = { hold() {}, shortcuts: [], directions: { drive: 0, twist: 0 } };
    const panel = new RehearsePanel({ connection, keys }), asked = [];
    connection.request = async (type) => {
      asked.push(type);
      if (type === "rehearsal.reset") connection.state.rehearsal = { state: "starting", mine: true };
    };
    panel.update = ({ rehearsal }) => panel.countdown.follow(rehearsal.state); // the rest needs more of a page
    panel.countdown.box.checked = true;
    panel.start();
    await settled();
    assert.deepEqual([asked, connection.sent, panel.countdown.counting], [["rehearsal.take", "rehearsal.reset"], [], false]);
    connection.state.rehearsal = { state: "ready", mine: true };
    panel.update(connection.state);
    assert.equal(panel.countdown.left, 3);
    for (let second = 0; second < 3; second += 1) {
      assert.deepEqual(connection.sent, []);
      mock.timers.tick(1000);
    }
    assert.deepEqual(connection.sent, [["rehearsal.start"]]);
  }
});
