import assert from "node:assert/strict";
import { afterEach, test } from "node:test";
import { PlannerError, finished, goesOn, jobs, missing, post, remove, wasCancelled } from "../../app/web/js/rest.js";

const real = globalThis.fetch;
afterEach(() => { globalThis.fetch = real; });

function answering(...answers) {
  const asked = [];
  globalThis.fetch = async (path, options) => {
    asked.push([options.method ?? "GET", path]);
    return answers.shift();
  };
  return asked;
}

const json = (body, status = 200) => new Response(JSON.stringify(body), { status });
const job = (fields) => ({ id: "job-1", state: "running", stage: "reading", fraction: 0.5, result: null, error: null, ...fields });

test("an error has the planner's words, code and what is missing", async () => {
  answering(json({ error: { code: "frame_error", message: "name the frame.", details: { missing: ["frame"] } } }, 400));
  const error = await post("/api/v1/x", {}).catch((reason) => reason);
  assert.ok(error instanceof PlannerError);
  assert.deepEqual([error.message, error.code, missing(error)], ["name the frame.", "frame_error", ["frame"]]);
});

test("an answer that is no JSON, and no answer, are said in words", async () => {
  answering(new Response("<html>", { status: 502 }));
  await assert.rejects(remove("/api/v1/x"), { message: "The planner answered 502." });
  globalThis.fetch = async () => { throw new TypeError("network"); };
  await assert.rejects(remove("/api/v1/x"), { message: "The planner does not answer." });
});

test("what carries no details misses nothing", () => {
  assert.deepEqual(missing(new Error("other")), []);
  assert.deepEqual(missing(new PlannerError({ code: "x", message: "y", details: null })), []);
});

test("204 is null", async () => {
  answering(new Response(null, { status: 204 }));
  assert.equal(await remove("/api/v1/x"), null);
});

test("a job is watched until it is done", async () => {
  const seen = [];
  const asked = answering(json(job({ fraction: 0.9 })), json(job({ state: "done", result: "case-1" })));
  const done = await finished(job({ state: "queued" }), (now) => seen.push(now.fraction), 1);
  assert.equal(done.result, "case-1");
  assert.deepEqual(seen, [0.5, 0.9]);
  assert.deepEqual(asked, [["GET", "/api/v1/jobs/job-1"], ["GET", "/api/v1/jobs/job-1"]]);
});

test("a job that fails throws what the planner says", async () => {
  const failed = job({ state: "failed", error: { code: "frame_error", message: "name the unit.", details: { missing: ["unit"] } } });
  const error = await finished(failed, () => {}, 1).catch((reason) => reason);
  assert.deepEqual([error.message, missing(error)], ["name the unit.", ["unit"]]);
});

test("a job that was cancelled is no failure of the file", async () => {
  const cancelled = job({ state: "cancelled", error: { code: "job_cancelled", message: "The work was cancelled.", details: null } });
  answering(json(cancelled));
  const error = await finished(job({}), () => {}, 1).catch((reason) => reason);
  assert.equal(wasCancelled(error), true);
  assert.equal(wasCancelled(new PlannerError({ code: "frame_error", message: "", details: null })), false);
  assert.equal(wasCancelled(null), false);
});

test("jobs that wait or run go on, the others do not", async () => {
  const states = ["queued", "running", "done", "failed", "cancelled"];
  const asked = answering(json(states.map((state) => job({ state }))));
  assert.deepEqual((await jobs()).map(goesOn), [true, true, false, false, false]);
  assert.deepEqual(asked, [["GET", "/api/v1/jobs"]]);
});
