import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";
import { DryRun } from "../../app/web/js/dry-run.js";
import { noted } from "./page.js";

/** An element as little as the dry run needs of one. */
function element() {
  return { style: {}, dataset: {}, children: [], append(...more) { this.children.push(...more); }, replaceChildren(...more) { this.children = more; }, setAttribute() {}, addEventListener() {} };
}

const real = { document: globalThis.document, fetch: globalThis.fetch };
let asked = [];

beforeEach(() => {
  asked = [];
  globalThis.document = { createElement: element };
  globalThis.fetch = async (path, options = {}) => {
    asked.push(`${options.method ?? "GET"} ${path}`);
    return new Response(null, { status: 204 });
  };
});
afterEach(() => Object.assign(globalThis, real));

const later = (ms) => new Promise((resolve) => { setTimeout(resolve, ms); });
const job = (fields) => ({ id: "job-1", kind: "dry_run", state: "running", stage: "Driving the path", fraction: 0.254, ...fields });

test("a longer run shows its stage and its share, is cancelled, and is offered again", async () => {
  const connection = noted({ jobs: { version: 1, items: [job({ id: "job-0", fraction: 0.9 }), job()] } });
  const run = new DryRun(connection, "verdict");
  run.update({ words: "the tool is driven", job: "job-1" });
  assert.equal(run.verdict.textContent, "The tool is driven");
  assert.equal(run.progress.hidden, true); // a run that ends at once shows no bar
  await later(450);
  assert.equal(run.progress.hidden, false);
  assert.equal(run.stage.textContent, "Driving the path, 25 %");
  assert.equal(run.bar.style.width, "25%");
  connection.state.jobs = { version: 2, items: [job({ fraction: 0.5 })] };
  run.update({ words: "the tool is driven", job: "job-1" });
  assert.equal(run.bar.style.width, "50%");
  await run.cancel();
  assert.ok(asked.includes("DELETE /api/v1/jobs/job-1"));
  run.update({ words: "cancelled", level: "unknown", short: "Not known: cancelled", cancelled: true, job: null });
  assert.equal(run.progress.hidden, true);
  assert.equal(run.again.hidden, false);
  assert.deepEqual([run.verdict.className, run.verdict.dataset.level], ["words verdict", "unknown"]);
  const [head, more] = run.verdict.children; // the sentence that banner and bar have, and nothing that it says already
  assert.deepEqual([head.children, more], [["Not known: cancelled."], ""]);
});

test("a run that has ended before anybody looks leaves no bar, and neither does one that another replaced", async () => {
  const connection = noted({ jobs: { version: 1, items: [] } });
  const run = new DryRun(connection, "verdict");
  run.update({ words: "", job: "job-1" });
  await later(450);
  assert.equal(run.progress.hidden, true);
  connection.state.jobs = { version: 2, items: [job({ id: "job-2" })] };
  run.update({ words: "", job: "job-2" });
  run.update({ words: "", job: null });
  await later(450);
  assert.equal(run.progress.hidden, true);
});
