// Review tells the planner which moment of a task is shown: the newest one, and not each of them while a run plays.
import assert from "node:assert/strict";
import { mock, test } from "node:test";
import { connectionOf, layOutElements } from "./panels.js";

layOutElements();
const { ReplayedTask } = await import("../../app/tabs/review/replayed-task.js");
mock.timers.enable({ apis: ["setTimeout"] });

function told() {
  const connection = connectionOf({}), player = Object.assign(new EventTarget(), { t: 0 });
  const task = new ReplayedTask(connection, /** @type {any} */ (player));
  const at = (/** @type {number} */ t) => { player.t = t; player.dispatchEvent(new Event("change")); };
  return { connection, task, at, moments: () => connection.sent.splice(0).map(([type, { run, t_s }]) => [type, run, t_s]) };
}

test("nothing is told of a run without a task", () => {
  const { task, at, moments } = told();
  task.of(null);
  at(1);
  assert.deepEqual(moments(), []);
});

test("of many moments the first and the newest are told, and one that is shown again is not", () => {
  const { task, at, moments } = told();
  task.of("a");
  for (const t of [0.01, 0.02, 0.0304]) at(t);
  assert.deepEqual(moments(), [["review.moment", "a", 0]]);
  mock.timers.tick(100);
  assert.deepEqual(moments(), [["review.moment", "a", 0.03]]);
  mock.timers.tick(100);
  at(0.0304);
  assert.deepEqual(moments(), []);
});

test("another run is told, none too, and all anew to a planner that was started again", () => {
  const { connection, task, at, moments } = told();
  task.of("a");
  task.of("b");
  mock.timers.tick(100);
  assert.deepEqual(moments(), [["review.moment", "a", 0], ["review.moment", "b", 0]]);
  mock.timers.tick(100);
  connection.tell("link", { connected: true, again: true });
  at(0);
  assert.deepEqual(moments(), [["review.moment", "b", 0]]);
  mock.timers.tick(100);
  task.of(null);
  mock.timers.tick(100);
  at(2);
  assert.deepEqual(moments(), [["review.moment", null, 0]]);
});
