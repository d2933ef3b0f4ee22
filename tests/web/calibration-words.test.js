import assert from "node:assert/strict";
import { test } from "node:test";
import { briefWords, pointerRows, robotRows, robotsTable, sentence } from "../../app/tabs/register/calibration-words.js";

const pointer = { residual_mm: 0.213, tip_error_mm: 0.0512, swing_deg: 33.4, poses: 60, measured_from: /** @type {const} */ ("tracker"), cautions: [] };
const robot = { translation_residual_mm: 0.1, rotation_residual_deg: 0.05, poses: 1, measured_from: /** @type {const} */ ("simulated"), cautions: [] };
const none = { to: /** @type {const} */ ("patient"), stays: "", pointer: null, robot: null, no_base: "" };

test("the group is told in one line", () => {
  assert.equal(briefWords(none), "to the patient");
  assert.equal(briefWords({ ...none, to: "base", pointer, robot }), "to the robot's base · tip ± 0.05 mm · robot simulated");
  assert.match(briefWords({ ...none, pointer: { ...pointer, measured_from: "simulated" }, robot: { ...robot, measured_from: "file" } }), /simulated · robot calibrated$/);
});

test("figures have units and their source", () => {
  assert.deepEqual(pointerRows(pointer).map((row) => row[1]), ["0.05 mm rms", "0.21 mm rms", "33°", "60 poses, tracked"]);
  assert.deepEqual(robotRows(robot).map((row) => row[1]), ["0.10 mm rms", "0.05° rms", "1 pose, simulated"]);
});

test("the robot's table is told from the tracker's", () => {
  const [flange, marker] = ["# unit=mm\n# pose = flange_to_base\n", "# unit=mm\n# pose=marker_to_tracker\n"];
  assert.equal(robotsTable([marker, flange]), 1);
  assert.equal(robotsTable([flange, marker]), 0);
  for (const wrong of [[flange], [flange, flange], [marker, marker], [marker, flange, marker]]) assert.equal(robotsTable(wrong), null);
});

test("a sentence begins with a capital", () => assert.equal(sentence("the robot"), "The robot"));
