// Review: what it asks of the planner and when, what it shows where a run cannot be scored, and its keys.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { keyEvent } from "./page.js";
import { FakeElement, connectionOf, layOutElements } from "./panels.js";

layOutElements();
Object.assign(globalThis, { localStorage: { getItem: () => null, setItem() {} } });
const { default: ReviewPanel } = await import("../../app/tabs/review/panel.js");
const { jobWatch } = await import("../../app/web/js/jobs.js");

const title = (id) => ({ id, mode: "hands-on", plan_id: "plan", recorded: "2026-01-01T10:00:00Z", score: null, comments: [] });
const score = (run) => ({
  run, mode: "hands-on", certified: true, completed: true, time_s: 1, path_error_mm: null, target_error_mm: null, angle_deg: null, least_clearance_mm: { bone: 1 }, reach_mm: 3,
  contacts: 0, max_depth_mm: null, held_s: 0, holds: [], path_length_mm: 1, spectral_arc_length: null,
});
const series = (run) => ({
  run, mode: "hands-on", certified: true, structures: ["bone"], joints: [], radii_mm: [1], phases: ["follow"], t_s: [0.1, 0.2], tip: [[0, 0, 0], [0, 0, 1]],
  segments: [[[0, 0, 5, 0, 0, 0]], [[0, 0, 6, 0, 0, 1]]], side: [[0, 1, 0], [0, 1, 0]], speed: [], clearance_mm: [[2, 1]], reach_mm: [3, 3], nearest: [0, 0], force_n: [1, 2], error_mm: [0.1, 0.2], progress_mm: [0, 1], phase: [0, 0], held: [0, 0],
});

/** A planner with two runs, whose answers the test may change or hold back. */
function planner() {
  const asked = [], held = [];
  const runs = ["one", "two"].map(title);
  const answers = new Map();
  const answer = (path) => {
    if (path.endsWith("/assignments")) return { status: 200, body: [] };
    const [, run, what] = path.match(/runs\/(\w+)\/(\w+)/) ?? [];
    return answers.get(`${run} ${what}`) ?? { status: 200, body: run ? (what === "score" ? score(run) : series(run)) : runs };
  };
  const now = { asked, answers, runs, held, holds: () => false, count: (part) => asked.filter((path) => path.includes(part)).length };
  Object.assign(globalThis, {
    fetch: (path) => new Promise((resolve) => {
      asked.push(path);
      const give = () => { const { status, body } = answer(path); resolve({ ok: status === 200, status, json: async () => body }); };
      if (now.holds(path)) held.push(give);
      else give();
    }),
  });
  return now;
}

const settled = async () => { for (let turn = 0; turn < 50; turn += 1) await null; };
const STATE = { step: { name: "review" }, case: { id: "head" }, plan: { id: "plan" }, plans: { items: [{ id: "plan", name: "A plan" }] } };

async function opened() {
  const panel = new ReviewPanel({ connection: connectionOf(STATE), keys: { shortcuts: [] } });
  panel.update(STATE);
  await settled();
  return panel;
}

const job = (id, kind) => ({ id, kind, state: "running", stage: "", fraction: 0 });
beforeEach(() => jobWatch.hear([]));

test("the list of runs is read anew when a run was stored, not with each progress of any job", async () => {
  const { asked, count } = planner();
  await opened();
  asked.splice(0);
  for (let progress = 0; progress < 20; progress += 1) jobWatch.hear([job("a", "dry_run"), job("b", "run")]);
  await settled();
  assert.deepEqual(asked, []);
  jobWatch.hear([job("a", "dry_run")]);
  jobWatch.hear([]);
  await settled();
  assert.equal(count("/cases/head/runs"), 1);
});

test("what is on its way is not asked for again", async () => {
  const now = planner();
  now.holds = (path) => /score|series/.test(path);
  const panel = await opened();
  for (let again = 0; again < 3; again += 1) {
    panel.refresh();
    await settled();
  }
  assert.deepEqual([now.count("/one/score"), now.count("/one/series")], [1, 1]);
  now.holds = () => false;
  for (const give of now.held.splice(0)) give();
  await settled();
  assert.equal(panel.player.main?.run.id, "one");
});

test("a run beside that cannot be shown hides neither the open one nor its own trouble", async () => {
  const now = planner();
  const refused = (words) => ({ status: 422, body: { error: { code: "x", message: words } } });
  now.answers.set("two score", refused("two cannot be scored.")).set("two series", refused("two has no series."));
  now.holds = (path) => path.includes("/one/");
  const panel = await opened();
  panel.toggle("two");
  await settled();
  now.holds = () => false;
  for (const give of now.held.splice(0)) give();
  await settled();
  assert.equal(panel.player.main?.run.id, "one", "it came later than the refusal");
  assert.equal(panel.trouble, "");
  panel.open("two");
  await settled();
  assert.match(panel.about.textContent, /No score: two cannot be scored/);
  assert.doesNotMatch(panel.about.textContent, /Scoring the run/);
});

test("Space plays with the time line in the hand, too", async () => {
  planner();
  Object.assign(globalThis, { requestAnimationFrame() {} });
  const panel = await opened();
  const target = Object.assign(new FakeElement("input"), { id: "run-time", type: "range" });
  const press = keyEvent("Space", { key: " ", target, stopPropagation() { press.stopped = true; } });
  panel.dock.key(press);
  assert.deepEqual([panel.player.playing, press.prevented, press.stopped], [true, true, true]);
  panel.dock.key({ ...press, repeat: true });
  assert.equal(panel.player.playing, true);
});

test("comments stand in the order of time, with a mark at each that has one", async () => {
  planner();
  const panel = await opened();
  const said = (id, step, t) => ({ id, t_s: t, step, text: `<b>${id}</b>`, written: "" });
  const marks = () => (panel.dock.bar.textContent.match(/Comment at [\d.]+ s/gu) ?? []);
  const run = panel.comments.run;
  assert.equal(run.id, "one");
  await panel.comments.tell(run, Promise.resolve(said("late", 9, 0.2)), (one) => [one, said("before", 1, null)]);
  const add = (one, now) => [...now, one], quick = [said("early", 4, 0.1), said("last", 12, null)];
  assert.deepEqual(await Promise.all(quick.map((one) => panel.comments.tell(run, Promise.resolve(one), add))), [true, true]);
  assert.deepEqual(panel.runs[0].comments.map(({ id }) => id), ["before", "early", "late", "last"], "of two quick ones neither is lost");
  assert.match(panel.comments.element.textContent, /<b>before<\/b>.*before.*<b>early<\/b>.*0\.1 s.*<b>late<\/b>.*0\.2 s/su, "as text, not as elements");
  assert.deepEqual(marks(), ["Comment at 0.1 s", "Comment at 0.2 s"]);
  assert.equal(await panel.comments.tell(run, Promise.reject(new Error("there is no run.")), () => []), false);
  assert.match(panel.list.element.textContent, /there is no run/);
  assert.equal(panel.runs[0].comments.length, 4);
});
