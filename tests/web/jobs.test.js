import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";
import { finished, jobWatch } from "../../app/web/js/jobs.js";
import { missing, wasCancelled } from "../../app/web/js/rest.js";

const job = (fields) => ({ id: "job-1", kind: "import", state: "running", stage: "reading", fraction: 0.5, ...fields });
const failed = (state, code, details) => job({ state, error: { code, message: "It ended.", details } });
const real = globalThis.fetch;
let asked;
/** How the planner's answers are let go, one after another, with the job that each one tells. */
let answer;

beforeEach(() => {
  asked = [];
  jobWatch.items = [];
  globalThis.fetch = (path, options = {}) => new Promise((resolve) => {
    asked.push(`${options.method ?? "GET"} ${path}`);
    answer = (body) => resolve(new Response(JSON.stringify(body)));
  });
});
afterEach(() => { globalThis.fetch = real; });

const settled = () => new Promise((resolve) => { setImmediate(resolve); });

/** Follow a job that messages have told of already. */
function followed() {
  const seen = [];
  jobWatch.hear([job({ fraction: 0.1 })]);
  return { seen, done: finished(job({ state: "queued", fraction: 0 }), (now) => seen.push(now.fraction)) };
}

test("messages tell how far a job is, and the planner is asked once, at its end", async () => {
  const { seen, done } = followed();
  await settled();
  jobWatch.hear([job({ id: "job-0" }), job({ fraction: 0.9 })]);
  await settled();
  assert.deepEqual([seen, asked], [[0, 0.1, 0.9], []]);
  jobWatch.hear([job({ id: "job-0" })]);
  await settled();
  answer(job({ state: "done", fraction: 1, result: "case-1" }));
  assert.equal((await done).result, "case-1");
  assert.deepEqual(asked, ["GET /api/v1/jobs/job-1"]);
});

test("a job that begins and ends between two messages wakes who waits for it", async () => {
  const done = finished(job({ state: "queued" }), () => {});
  await settled();
  answer(job());
  await settled();
  jobWatch.hear([]);
  await settled();
  answer(job({ state: "done", result: "case-1" }));
  assert.equal((await done).result, "case-1");
});

test("an end that is told while the planner's answer is under way is not missed", async () => {
  const done = finished(job({ state: "queued" }), () => {});
  await settled();
  jobWatch.hear([]); // it has ended
  answer(job()); // of before
  await settled();
  answer(job({ state: "done", result: "case-1" }));
  assert.equal((await done).result, "case-1");
  assert.equal(asked.length, 2);
});

test("the first message of a new connection tells the end of a job that ended while there was none", async () => {
  const { done } = followed();
  await settled();
  jobWatch.hear([job({ fraction: 0.1 })]); // as it was when the connection was lost
  jobWatch.hear([]);
  await settled();
  answer(job({ state: "done", result: "case-1" }));
  assert.equal((await done).result, "case-1");
});

test("what a job failed with, or was cancelled by, is thrown", async () => {
  const error = await finished(failed("failed", "frame_error", { missing: ["unit"] }), () => {}).catch((reason) => reason);
  assert.deepEqual([error.message, missing(error), wasCancelled(error)], ["It ended.", ["unit"], false]);
  const { done } = followed();
  jobWatch.hear([]);
  await settled();
  answer(failed("cancelled", "job_cancelled", null));
  assert.equal(wasCancelled(await done.catch((reason) => reason)), true);
});

test("only a message about jobs counts as one", () => {
  const connection = { on(...[, listener]) { connection.listener = listener; } };
  jobWatch.follow(connection);
  const { heard } = jobWatch;
  const state = { jobs: { version: 1, items: [job()] } };
  connection.listener({ state, changed: ["plan"] });
  assert.deepEqual([jobWatch.heard, jobWatch.items], [heard, []]);
  connection.listener({ state, changed: ["plan", "jobs"] });
  assert.deepEqual([jobWatch.heard, jobWatch.items], [heard + 1, [job()]]);
});
