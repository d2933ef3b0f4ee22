// What really happens: a switch stays as it was clicked while the planner still tells what was before.
import assert from "node:assert/strict";
import { test } from "node:test";
import { layOutElements } from "./panels.js";

layOutElements();
const { TruthGroup, notTold } = await import("../../app/tabs/rehearse/truth.js");

const stage = (name, value, on) => ({ name, label: name, unit: "mm", most: 3, step: 0.05, value, on, known: false, hint: "", refusal: "" });
const truth = (...stages) => ({ stages, followed: false, compensated_mm_per_n: 0 });

/** The group with its drawing left out, and the requests that the test answers. */
function group(told) {
  const asked = [], answers = [], said = [];
  const request = (...[, fields]) => {
    asked.push(fields);
    return new Promise((resolve, reject) => { answers.push({ resolve, reject }); });
  };
  const one = new TruthGroup({ request, say: (...[, detail]) => said.push(detail.words) });
  one.render = () => {};
  one.update({ truth: told });
  return { one, asked, answers, said };
}

test("two switches clicked before the planner tells of the first are both off", () => {
  const { one, asked } = group(truth(stage("registration", 0.8, true), stage("compliance", 0.1, true)));
  one.choose({ registration: null });
  one.choose({ compliance: null });
  assert.deepEqual(asked[1], { registration: null, compliance: null, followed: false });
});

test("what was chosen is shown until the planner tells it, and no longer", () => {
  const { one } = group(truth(stage("registration", 0.3, true)));
  one.choose({ registration: 0.8 });
  one.update({ truth: truth(stage("registration", 0.3, true)) });
  assert.deepEqual(one.chosen, { registration: 0.8 });
  one.update({ truth: truth(stage("registration", 0.8, true)) });
  assert.deepEqual(one.chosen, {});
});

test("a choice that was refused is not shown", async () => {
  const { one, answers, said } = group(truth(stage("registration", 0.3, false)));
  one.choose({ registration: 0.3 });
  answers[0].reject(new Error("No drive."));
  await new Promise((resolve) => { setTimeout(resolve); });
  assert.deepEqual([one.chosen, said], [{}, ["No drive."]]);
});

test("sizes are told as the planner rounds them", () => {
  assert.deepEqual(notTold({ registration: 0.12344 }, truth(stage("registration", 0.1234, true))), {});
  assert.deepEqual(notTold({ followed: true, head: null }, truth(stage("head", 0.5, true))), { followed: true, head: null });
});
