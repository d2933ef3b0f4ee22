// Rehearse: the marks of a tool without the certificate, and the sliders of its settings.
import assert from "node:assert/strict";
import { test } from "node:test";
import { noted } from "./page.js";
import { layOutElements } from "./panels.js";

layOutElements();
const { ModesGroup } = await import("../../app/tabs/rehearse/modes.js");
const { RehearsalStatus } = await import("../../app/tabs/rehearse/status.js");

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
