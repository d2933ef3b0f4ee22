// Numbers that are typed in Drive: one that cannot be taken is said below its field, and sent to nobody.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { connectionOf, layOutElements, layOutInputs } from "./panels.js";

const { document } = layOutElements();
const inputs = layOutInputs(document);
const { controlGroup } = await import("../../app/tabs/drive/control.js");
const { taskGroup } = await import("../../app/tabs/drive/task.js");
const { tissueGroup } = await import("../../app/tabs/drive/tissue.js");

const connection = connectionOf({}), sent = () => connection.sent.splice(0);
const LINK = { bound_mm: null, threshold_mm: 2, spring_n_per_mm: 0.5 };
const OPTIONS = { arm: "manual", preset: null, links: [LINK, LINK, LINK, LINK, { ...LINK, bound_mm: 8 }], open: true };
const TASK = { offered: ["polyps"], labels: null, task: "polyps", places: "seed", seed: 7, marks: 0, open: true, now: null };
const ROUTE = { breathing_mm: 3, breathing_period_s: 4, peristalsis: 0.25, peristalsis_period_s: 6, locked: false };
const drawn = (/** @type {any} */ { options = OPTIONS, task = TASK, route = ROUTE } = {}) => {
  controlGroup(connection, options, null, false);
  taskGroup(connection, task);
  tissueGroup(connection, route);
};
const field = (/** @type {string} */ id) => /** @type {any} */ (inputs.get(id));

beforeEach(() => drawn());

test("no wrong number ends the run or reaches the route", () => {
  const ids = ["link-5-bound_mm", "link-1-bound_mm", "link-5-threshold_mm", "link-1-spring_n_per_mm", "task-seed", "breathing-mm", "breathing-s", "peristalsis-percent", "peristalsis-s"];
  for (const id of ids) {
    for (const text of ["abc", "-1", "1e12"]) {
      field(id).typed(text);
      assert.match(field(id).said, /can be used/, `${id} ${text}`);
      drawn();
      assert.deepEqual([field(id).value, field(id).getAttribute("aria-invalid")], [text, "true"], "what was typed stays, with what is wrong");
    }
    field(id).press("Escape");
    assert.deepEqual([field(id).said, field(id).value], ["", field(id).dataset.known]);
  }
  for (const id of ids.filter((one) => !one.endsWith("bound_mm"))) {
    field(id).typed(" ");
    assert.match(field(id).said, /Nothing is typed/, id);
    field(id).press("Escape");
  }
  assert.deepEqual(sent(), []);
});

test("a value of a link is sent with those of the others, and an empty bound is that of the route", () => {
  field("link-5-bound_mm").typed("6,5");
  field("link-5-bound_mm").typed("");
  field("link-4-threshold_mm").typed("1");
  assert.deepEqual(sent().map(([, { bounds_mm, thresholds_mm }]) => [bounds_mm, thresholds_mm]), [
    [[null, null, null, null, 6.5], [2, 2, 2, 2, 2]],
    [null, [2, 2, 2, 2, 2]],
    [[null, null, null, null, 8], [2, 2, 2, 1, 2]],
  ]);
});

test("an arrow key changes no value, where another one would end the run", () => {
  for (const id of ["link-5-bound_mm", "task-seed"]) field(id).press("ArrowUp");
  assert.deepEqual(sent(), []);
});

test("a seed is a whole number, and the other choices stay", () => {
  field("task-seed").typed("12");
  assert.deepEqual(sent(), [["drive.task", { task: "polyps", places: "seed", seed: 12 }]]);
  drawn({ task: { ...TASK, seed: 12 } });
  assert.equal(field("task-seed").value, "12");
});

test("an amplitude is sent with its period, and a period with its amplitude", () => {
  field("breathing-mm").typed("4,5");
  field("breathing-s").typed("5");
  field("peristalsis-percent").typed("30");
  assert.deepEqual(sent(), [
    ["route.breathing", { breathing_mm: 4.5, period_s: 4 }], ["route.breathing", { breathing_mm: 4.5, period_s: 5 }], ["route.peristalsis", { share: 0.3, period_s: 6 }],
  ]);
  drawn({ route: { ...ROUTE, locked: true } });
  assert.equal(field("breathing-mm").disabled, true);
});
