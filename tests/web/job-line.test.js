// Which job a line shows when another one is followed before the first has ended.
import assert from "node:assert/strict";
import { test } from "node:test";
import { jobWatch } from "../../app/web/js/jobs.js";
import { layOutPage } from "./page.js";

class Element extends EventTarget {
  style = {};
  hidden = false;
  append() {}
  setAttribute() {}
}

const { document } = layOutPage();
Object.assign(document, { createElement: () => new Element() });
const { JobLine } = await import("../../app/web/js/job-line.js");

const job = (/** @type {string} */ id, fields = {}) => /** @type {any} */ ({ id, state: "running", stage: `stage of ${id}`, fraction: 0.5, ...fields });
const settled = () => new Promise((resolve) => { setImmediate(resolve); });

test("a line shows the job that is followed now, and stays when one before it goes on or ends", async () => {
  globalThis.fetch = async (path) => new Response(JSON.stringify(job(String(path).slice(-1), { state: "done", result: "made" })));
  const line = new JobLine();
  jobWatch.hear([job("a"), job("b")]);
  const first = line.follow(job("a"));
  await settled();
  const second = line.follow(job("b"));
  await settled();
  jobWatch.hear([job("a", { stage: "later" }), job("b")]);
  await settled();
  assert.match(String(line.stage.textContent), /^Stage of b/);
  jobWatch.hear([job("b")]);
  assert.equal(await first, "made");
  assert.deepEqual([line.job, line.element.hidden], ["b", false]);
  jobWatch.hear([]);
  assert.equal(await second, "made");
  assert.deepEqual([line.job, line.element.hidden], [null, true]);
});

test("a line that is left shows nothing more of its job", async () => {
  const line = new JobLine();
  jobWatch.hear([job("a")]);
  const ended = line.follow(job("a"));
  await settled();
  line.leave();
  jobWatch.hear([job("a", { fraction: 0.9 })]);
  await settled();
  assert.equal(line.element.hidden, true);
  jobWatch.hear([]);
  assert.equal(await ended, "made");
});
