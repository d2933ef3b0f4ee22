import assert from "node:assert/strict";
import { test } from "node:test";
import { layOutPage } from "./page.js";
import { JobList, jobWords } from "../../app/web/js/job-list.js";
import { jobWatch } from "../../app/web/js/jobs.js";

const job = (fields) => ({ id: "job-1", kind: "import", subject: "Block", state: "running", stage: "Reading the file", fraction: 0.254, ...fields });

test("a job is told by what it works on, its stage and its share", () => {
  assert.equal(jobWords(job({})), "Import ‘Block’: Reading the file, 25 %");
  assert.equal(jobWords(job({ kind: "segmentation", subject: "Orbit", fraction: 1 })), "Segmentation ‘Orbit’: Reading the file, 100 %");
});

test("one that waits has no share, and a name that cannot be used is left out", () => {
  assert.equal(jobWords(job({ state: "queued", stage: "waiting", fraction: 0 })), "Import ‘Block’: waiting for its turn");
  assert.equal(jobWords(job({ subject: "" })), "Import: Reading the file, 25 %");
});

test("a job stands in the first list that holds it, and each change is told", () => {
  const { document } = layOutPage();
  Object.assign(document, { createElement: () => ({ append: () => {} }) });
  const list = new JobList(() => {});
  const filled = new Map();
  list.fill = (element, items) => filled.set(element, items.map(({ id }) => id));
  const [mine, segmentations] = [list.beside(({ id }) => id === "job-2"), list.beside(({ kind }) => kind === "segmentation")];
  let changes = 0;
  list.addEventListener("change", () => { changes += 1; });
  for (const one of [job({}), job({ id: "job-2", kind: "segmentation" }), job({ id: "job-3", kind: "segmentation" })]) list.show(one);
  assert.deepEqual([mine, segmentations, list.element].map((element) => filled.get(element)), [["job-2"], ["job-3"], ["job-1"]]);
  assert.equal(changes, 3);
});

test("jobs that somebody began are found once when the page is loaded, and then while the list is shown", () => {
  const { document } = layOutPage();
  Object.assign(document, { createElement: () => ({ append: () => {} }) });
  Object.assign(jobWatch, { heard: 0, items: [] });
  const list = new JobList(() => {});
  const found = [];
  list.watch = ({ id }) => found.push(id);
  jobWatch.hear([job({}), job({ id: "job-2", kind: "islands" })]);
  jobWatch.hear([job({ id: "job-3" })]);
  assert.deepEqual(found, ["job-1"]);
  Object.assign(list.element, { isConnected: true });
  list.look();
  assert.deepEqual(found, ["job-1", "job-3"]);
});

test("a list about jobs of its own finds them whoever began them, and shows those that it holds now", () => {
  const { document } = layOutPage();
  Object.assign(document, { createElement: () => ({ append: () => {} }) });
  Object.assign(jobWatch, { heard: 0, items: [] });
  let plan = "a";
  const begun = [];
  const list = new JobList(() => {}, { holds: ({ kind, document_id: of }) => kind === "tools" && of === plan, begun: ({ id }) => begun.push(id) });
  let shown = [];
  list.fill = (...filled) => { shown = filled[1].map(({ id }) => id); };
  const items = [job({ kind: "tools", document_id: "a" }), job({ id: "job-2", kind: "tools", document_id: "b" }), job({ id: "job-3" })];
  jobWatch.hear(items);
  jobWatch.hear(items);
  assert.deepEqual([begun, shown], [["job-1"], ["job-1"]], "though the list is not in sight");
  plan = "b";
  list.again();
  assert.deepEqual([begun, shown], [["job-1", "job-2"], ["job-2"]]);
  plan = "a";
  list.again();
  assert.deepEqual([begun, shown], [["job-1", "job-2"], ["job-1"]]);
});
