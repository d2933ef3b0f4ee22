import assert from "node:assert/strict";
import { test } from "node:test";
import { jobWords } from "../../app/web/js/job-list.js";

const job = (fields) => ({ id: "job-1", kind: "import", subject: "Block", state: "running", stage: "Reading the file", fraction: 0.254, ...fields });

test("a job is told by what it works on, its stage and its share", () => {
  assert.equal(jobWords(job({})), "Import ‘Block’: Reading the file, 25 %");
  assert.equal(jobWords(job({ kind: "dry_run", subject: "Plan 1", fraction: 1 })), "Dry run ‘Plan 1’: Reading the file, 100 %");
});

test("one that waits has no share, and a name that cannot be used is left out", () => {
  assert.equal(jobWords(job({ state: "queued", stage: "waiting", fraction: 0 })), "Import ‘Block’: waiting for another one");
  assert.equal(jobWords(job({ subject: "" })), "Import: Reading the file, 25 %");
});
