import assert from "node:assert/strict";
import { afterEach, test } from "node:test";
import { PlannerError, missing, remove, send, wasCancelled } from "../../app/web/js/rest.js";

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

test("an error has the planner's words, code and what is missing", async () => {
  answering(json({ error: { code: "frame_error", message: "name the frame.", details: { missing: ["frame"] } } }, 400));
  const error = await send("/api/v1/x", {}).catch((reason) => reason);
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

test("a job that was cancelled is no failure of the file", () => {
  assert.equal(wasCancelled(new PlannerError({ code: "job_cancelled", message: "The work was cancelled.", details: null })), true);
  assert.equal(wasCancelled(new PlannerError({ code: "frame_error", message: "", details: null })), false);
  assert.equal(wasCancelled(null), false);
});
