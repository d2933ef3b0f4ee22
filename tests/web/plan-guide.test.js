// Which step of a plan is open, and the result of each in one line.
import assert from "node:assert/strict";
import { test } from "node:test";
import { ADDS, Guide, moreLine, nextStep, stepLine } from "../../app/tabs/plan/guide.js";

const items = (/** @type {string} */ letter, /** @type {number} */ count) => [...Array(count).keys()].map((n) => ({ id: `${letter}${n + 1}`, label: `${letter}${n + 1}`, position: [n, 0, 0] }));
const plan = (/** @type {number} */ points, /** @type {number} */ targets, fields = {}) => /** @type {any} */ ({
  id: "plan", points: items("P", points), targets: items("T", targets), selected: null, length_mm: 81.2,
  tool: { title: "Bent tool 30°", trouble: "", changed: false }, robot: { title: "Steady hand", name: "steady_hand", trouble: "" }, ...fields,
});
const known = (fields = {}) => /** @type {any} */ ({ suggestion: null, searching: null, short: "", verdict: { words: "Fits, bone 0.55 mm", mark: "done" }, ...fields });

test("the next step is the first that the path lacks", () => {
  assert.deepEqual([plan(0, 0), plan(0, 1), plan(1, 0), plan(1, 1), plan(2, 0)].map(nextStep), ["entry", "entry", "targets", "path", "path"]);
  assert.deepEqual([ADDS.entry, ADDS.targets, ADDS.protect, ADDS.path, ADDS.check], ["point", "target", "none", "point", "none"]);
});

test("the guide goes on with what this window adds, and with nothing else", () => {
  const guide = new Guide();
  assert.equal(guide.follow(plan(0, 0), false), "entry");
  assert.equal(guide.follow(plan(1, 0, { selected: "P1" }), false), "targets");
  assert.equal(guide.follow(plan(1, 1), false), null); // of another window, where it is selected
  assert.deepEqual([guide.open, guide.marked], ["targets", "path"]);
  assert.equal(guide.follow(plan(1, 0), false), null);
  assert.equal(guide.follow(plan(1, 1, { selected: "T1" }), true), null); // somebody types within the step
  assert.deepEqual([guide.open, guide.marked], ["targets", "path"]);
  assert.equal(guide.follow(plan(7, 1), false), null);
  assert.equal(guide.marked, ""); // there is a path
});

test("what somebody opens stays open until another plan is", () => {
  const guide = new Guide();
  guide.follow(plan(0, 0), false);
  guide.choose("tool", true);
  assert.equal(guide.follow(plan(1, 0, { selected: "P1" }), false), null);
  assert.deepEqual([guide.open, guide.marked], ["tool", "targets"]);
  guide.choose("tool", false);
  assert.equal(guide.open, "");
  assert.equal(guide.follow(plan(0, 0, { id: "other" }), false), "entry");
  assert.equal(guide.follow(plan(1, 0, { id: "other", selected: "P1" }), false), "targets");
  guide.follow(null, false);
  assert.equal(guide.open, "");
  assert.equal(guide.follow(plan(4, 2, { id: "other" }), false), "path");
});

test("a closed step is one line with its result", () => {
  const lines = (/** @type {any} */ state, fields = {}) => ["entry", "targets", "protect", "path", "tool", "check", "export"].map((name) => stepLine(/** @type {any} */ (name), state, known(fields)).words);
  assert.deepEqual(lines({ plan: plan(0, 0) }), ["None", "None", "None", "None", "Bent tool 30°", "Needs a path", "Needs a path"]);
  const paths = { chosen: "a", side_caution: "", items: [{ id: "a", entry_side: "right" }] };
  const regions = { items: [{ purpose: "spare", name: "Optic nerve" }, { purpose: "remove", name: "Septum" }] };
  assert.deepEqual(lines({ plan: plan(6, 2), paths, regions, corridor: { state: "current", status: "done" } }),
    ["Right nostril", "2 targets", "Optic nerve", "81 mm, 6 points", "Bent tool 30°", "Fits, bone 0.55 mm", "Ready"]);
  const exported = (/** @type {string | null} */ level, state = "current") => stepLine("export", /** @type {any} */ ({ plan: plan(6, 2), corridor: { level, state, status: "done", word: "Blocked" } }), known());
  const caution = { words: "Blocked plan", mark: "caution" };
  assert.deepEqual([exported("blocked"), exported("pierces"), exported("blocked", "none"), exported("tight").words, exported(null, "waits").words], [caution, caution, caution, "Ready", "Not simulated"]);
  const updating = { words: "updating", mark: "" }, before = /** @type {any} */ ({ level: null, state: "waits", status: "computing", verdict: {} });
  assert.deepEqual(["check", "export"].map((name) => stepLine(/** @type {any} */ (name), { plan: plan(6, 2), corridor: before }, known({ verdict: updating }))), [updating, updating]);
  assert.deepEqual(stepLine("entry", { plan: plan(1, 0) }, known()), { words: "Choose a side", mark: "" });
  assert.equal(stepLine("entry", { plan: plan(1, 0), paths: { ...paths, side_caution: "Left of the septum." } }, known()).mark, "caution");
  assert.deepEqual(stepLine("path", { plan: plan(6, 2) }, known({ short: "32 mm short" })), { words: "81 mm", mark: "caution", pill: "32 mm short" });
  const tool = { title: "Bent pointer, 30°", trouble: "" };
  assert.equal(stepLine("tool", { plan: plan(2, 0, { tool }) }, known()).words, "Bent pointer 30°");
  const deleted = /** @type {any} */ ({ registration: "r", state: "deleted" });
  assert.deepEqual(stepLine("tool", { plan: plan(2, 0), plan_use: deleted }, known()), { words: "Registration unusable", mark: "caution" });
  assert.deepEqual(stepLine("tool", { plan: plan(2, 0, { tool: { trouble: "gone" } }) }, known()), { words: "Tool unreadable", mark: "caution" });
});

test("what is rare says what it holds", () => {
  const state = /** @type {any} */ ({ regions: { items: [{ purpose: "spare", name: "Orbit" }, { purpose: "remove", name: "Septum" }] }, versions: { items: [{ name: "a" }, { name: "b" }] }, paths: { notes: "Deviates.\nMore" } });
  assert.deepEqual(["bone", "versions", "notes"].map((name) => moreLine(name, state).words), ["Septum", "2 versions", "Deviates."]);
  assert.deepEqual(["bone", "versions", "notes"].map((name) => moreLine(name, {}).words), ["", "", ""]);
});

test("the line of the path tells of the ways that were found", () => {
  const line = (/** @type {any} */ one, /** @type {any} */ fields) => stepLine("path", { plan: one }, known(fields)).words;
  const ways = [3, 6].map((count) => ({ points: items("P", count) }));
  const suggestion = { plan_id: "plan", none: null, alternatives: ways };
  assert.equal(line(plan(6, 1), { suggestion }), "81 mm, way 2 of 2");
  assert.equal(line(plan(5, 1), { suggestion }), "81 mm, 5 points");
  assert.equal(line(plan(1, 1), { suggestion }), "2 ways found");
  assert.equal(line(plan(1, 1), { suggestion, searching: 0.4 }), "Searching, 40 %");
  assert.equal(line(plan(1, 1), { suggestion: { ...suggestion, alternatives: [], none: {} } }), "No way found");
  assert.equal(line(plan(1, 1), { suggestion: { ...suggestion, plan_id: "other" } }), "None");
});
