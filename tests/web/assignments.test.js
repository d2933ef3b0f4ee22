// The assignment of the open plan: the newest one of it, with words for limits and values.
import assert from "node:assert/strict";
import { test } from "node:test";
import { FakeElement, layOutElements } from "./panels.js";

layOutElements();
const said = [], notes = Object.assign(new FakeElement("div"), { append: (note) => said.push(note.textContent) });
Object.assign(globalThis.document, { getElementById: () => notes });
const { assignment, limitWords, valueWords } = await import("../../app/web/js/assignments.js");
const { jobWatch } = await import("../../app/web/js/jobs.js");
const settled = async () => { for (let turn = 0; turn < 50; turn += 1) await null; };
const time = { name: "max_time_s", label: "Time", unit: "s", limit: 60 };

test("limits and values in words", () => {
  assert.equal(limitWords(time), "≤ 60 s");
  assert.equal(limitWords({ name: "min_clearance_mm", label: "Least clearance", unit: "mm", limit: 0.3 }), "≥ 0.3 mm");
  assert.equal(limitWords({ name: "completed", label: "Path completed", unit: "", limit: true }), "yes");
  assert.deepEqual([12.345, 0.0123, null, true].map((value) => valueWords({ ...time, unit: "mm", value, passed: true })), ["12.3", "0.012", "–", "yes"]);
  assert.equal(valueWords({ ...time, value: 0.323, passed: true }), "0.3");
  assert.equal(valueWords({ ...time, unit: "", value: 3, passed: true }), "3");
});

test("the newest of the open plan, with its results; read anew when a run was stored", async () => {
  const all = [{ id: "old", name: "Old", plan_id: "plan" }, { id: "new", name: "New", plan_id: "plan" }, { id: "other", name: "Other", plan_id: "else" }], asked = [];
  Object.assign(globalThis, { fetch: async (path) => {
    asked.push(path);
    return { ok: true, status: 200, json: async () => (path.includes("results") ? { name: "New", passed: asked.length, criteria: [time], runs: [] } : all) };
  } });
  assignment.follow({ case: { id: "head" }, plan: { id: "plan" } });
  await settled();
  assert.deepEqual(asked, ["/api/v1/cases/head/assignments", "/api/v1/assignments/new/results"]);
  assert.equal(assignment.open?.name, "New");
  assignment.follow({ case: { id: "head" }, plan: { id: "plan" } });
  jobWatch.hear([{ id: "job", kind: "run", document_id: "plan", state: "running" }]);
  await settled();
  assert.equal(asked.length, 2, "nothing has changed");
  jobWatch.hear([]);
  await settled();
  assert.equal(assignment.results?.passed, 4);
  assignment.follow({ case: { id: "head" }, plan: { id: "nothing" } });
  await settled();
  assert.deepEqual([assignment.open, assignment.results], [null, null]);
});

test("what cannot be read is said once, and again after it could", async () => {
  let refused = true;
  Object.assign(globalThis, { fetch: async () => ({ ok: !refused, status: refused ? 500 : 200, json: async () => (refused ? { error: { code: "x", message: "the disk is gone." } } : []) }) });
  assignment.follow({ case: { id: "head" }, plan: { id: "broken" } });
  await settled();
  await assignment.refresh();
  assert.equal(said.length, 1);
  assert.match(said[0], /The disk is gone|the disk is gone/u);
  refused = false;
  await assignment.refresh();
  refused = true;
  await assignment.refresh();
  assert.equal(said.length, 2);
});
