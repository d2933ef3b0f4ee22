// The card at the end of a run: which run it is about, and that it never waits for one that does not come.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { FakeElement, connectionOf, layOutElements } from "./panels.js";

const { document } = layOutElements();
const notes = new FakeElement("div");
Object.assign(document, { getElementById: () => notes });
Object.assign(globalThis, { localStorage: { getItem: () => null, setItem() {} } });
const { EndCard } = await import("../../app/web/js/end-card.js");
const { jobWatch } = await import("../../app/web/js/jobs.js");

const title = (id, plan = "plan") => ({ id, plan_id: plan, mode: "hands-on", origin: "page", recorded: "2026-01-01T10:00:00Z", score: null });
const score = () => ({ certified: true, completed: true, time_s: 1, path_error_mm: null, target_error_mm: null, angle_deg: null, least_clearance_mm: { bone: 1 }, reach_mm: 3, contacts: 0, held_s: 0, holds: [], spectral_arc_length: null });
const settled = async () => { for (let turn = 0; turn < 50; turn += 1) await null; };
const job = (id, plan = "plan") => ({ id, kind: "run", document_id: plan, case_id: "head", state: "running", stage: "Scoring the run", fraction: 0.7 });

/** A window that holds the handle of a plan's drive, and a planner whose jobs and runs the test changes. */
function station(timers) {
  timers.enable({ apis: ["setTimeout"] });
  const state = { case: { id: "head" }, plan: { id: "plan" }, rehearsal: { state: "ready", mine: true } };
  const connection = connectionOf(state), card = new EndCard(connection);
  const runs = [title("old")], results = new Map();
  const answer = (path) => (path.includes("/jobs/") ? { result: results.get(path.split("/").at(-1)) ?? null, error: null } : path.endsWith("/score") ? score() : runs);
  Object.assign(globalThis, { fetch: async (path) => ({ ok: true, status: 200, json: async () => answer(path) }) });
  connection.request = async () => {};
  const now = (drive, plan = state.plan.id) => {
    state.rehearsal.state = drive;
    state.plan.id = plan;
    card.update(state);
    return settled();
  };
  const store = (id, run) => {
    jobWatch.hear(jobWatch.items.filter((one) => one.id !== id));
    results.set(id, run);
    runs.unshift(title(run));
    return settled();
  };
  return { card, connection, runs, results, now, store, tick: async (ms) => { timers.tick(ms); await settled(); } };
}

beforeEach(() => jobWatch.hear([]));

test("the run that its own job has stored is shown", async ({ mock }) => {
  const { card, now, runs, results } = station(mock.timers);
  await now("ready");
  await now("running");
  await card.finish();
  await now("absent");
  assert.match(card.element.textContent, /Scoring the run/);
  jobWatch.hear([job("a")]);
  runs.unshift(title("new"));
  results.set("a", "new");
  runs.unshift(title("later"));
  jobWatch.hear([]);
  await settled();
  assert.equal(card.ended?.run.id, "new");
  assert.match(card.element.textContent, /Path completed/);
});

test("a job of another plan is none of this drive's", async ({ mock }) => {
  const { card, now, runs, tick } = station(mock.timers);
  await now("running");
  await now("paused");
  jobWatch.hear([job("b", "other")]);
  jobWatch.hear([]);
  await settled();
  assert.doesNotMatch(card.element.textContent, /No score|Scoring the run/);
  await card.finish();
  await now("absent");
  runs.unshift(title("new")); // its job came and went between two messages
  await tick(2000);
  assert.equal(card.ended?.run.id, "new");
});

test("while the tool is out, what is stored of the drive before is not shown, and not taken for this one's", async ({ mock }) => {
  const { card, now, store, tick } = station(mock.timers);
  await now("running");
  jobWatch.hear([job("free")]); // from a free hand to hands-on
  await now("ready");
  await now("running");
  assert.doesNotMatch(card.element.textContent, /Scoring the run/);
  await store("free", "first");
  assert.doesNotMatch(card.element.textContent, /No score|Path completed/);
  await card.finish();
  await now("absent");
  await tick(2000);
  assert.match(card.element.textContent, /No score: this run was not recorded/, "‘first’ is the run before");
  assert.equal(card.ended, null);
});

test("a refused end leaves no waiting, and is said", async ({ mock }) => {
  const { card, connection, now, tick } = station(mock.timers);
  connection.request = async () => { throw new Error("only the window that holds the handle can do that"); };
  await now("running");
  await card.finish();
  await tick(5000);
  await now("paused");
  assert.doesNotMatch(card.element.textContent, /Scoring the run|No score/);
  assert.match(notes.textContent, /Only the window that holds the handle/);
});

test("trouble of a plan that is not open any more is not told of the one that is", async ({ mock }) => {
  const { card, now } = station(mock.timers);
  await now("running");
  jobWatch.hear([job("a")]);
  await now("absent");
  let refuse = () => {};
  Object.assign(globalThis, { fetch: () => new Promise((...[, reject]) => { refuse = reject; }) });
  jobWatch.hear([]);
  await settled();
  await now("absent", "other");
  refuse(new Error("gone"));
  await settled();
  assert.deepEqual([card.trouble, card.element.hidden], ["", true]);
});
