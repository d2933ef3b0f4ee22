// 3, 2, 1 before Start: off at first, by the browser or by the assignment, and called off by Escape or Pause.
import assert from "node:assert/strict";
import { test } from "node:test";
import { layOutElements } from "./panels.js";

layOutElements();
const kept = new Map();
Object.assign(globalThis, { localStorage: { getItem: (name) => kept.get(name) ?? null, setItem: (name, value) => kept.set(name, value) } });
const { Countdown } = await import("../../app/tabs/rehearse/countdown.js");
const { assignment } = await import("../../app/web/js/assignments.js");

/** A countdown, and what it did. */
function station({ mock }) {
  mock.timers.enable({ apis: ["setTimeout"] });
  const shown = [], done = [];
  const countdown = new Countdown(() => shown.push(countdown.number.textContent));
  return { countdown, shown, done, start: () => countdown.before(() => done.push("start")), second: () => mock.timers.tick(1000) };
}

test("without one the drive starts at once", (context) => {
  const { countdown, done, shown, start } = station(context);
  start();
  assert.deepEqual([done, shown, countdown.counting], [["start"], [], false]);
});

test("3, 2, 1, and only then it starts; what was chosen is kept", (context) => {
  const { countdown, done, shown, start, second } = station(context);
  countdown.box.checked = true;
  countdown.box.onchange?.();
  start();
  for (const left of [2, 1]) {
    second();
    assert.deepEqual([countdown.left, done], [left, []]);
  }
  second();
  assert.deepEqual([done, countdown.counting, shown], [["start"], false, ["3", "2", "1", ""]]);
  for (let more = 0; more < 5; more += 1) second();
  assert.deepEqual(done, ["start"], "once");
});

test("Escape calls it off, and a press of Start begins anew", (context) => {
  const { countdown, done, start, second } = station(context);
  countdown.box.checked = true;
  assert.equal(countdown.key({ key: "Escape" }), false, "nothing counts: Escape means what it meant");
  start();
  second();
  assert.equal(countdown.key({ key: "a" }), false);
  assert.equal(countdown.key({ key: "Escape" }), true);
  for (let more = 0; more < 5; more += 1) second();
  assert.deepEqual([done, countdown.number.hidden], [[], true]);
  start();
  start();
  for (let more = 0; more < 3; more += 1) second();
  assert.deepEqual(done, ["start"], "two presses are one countdown");
});

test("an assignment asks for it", (context) => {
  const { countdown, start, done } = station(context);
  assignment.open = { id: "a", name: "A", plan_id: "plan", countdown: true };
  start();
  assert.deepEqual([done, countdown.left], [[], 3]);
  countdown.cancel();
  assignment.open = null;
});

test("of a tool that is not there yet it counts once that stands, and not where it does not come", (context) => {
  const { countdown, start, second, done } = station(context);
  countdown.box.checked = true;
  countdown.whenPlaced(() => done.push("start"));
  for (const state of ["starting", "starting"]) {
    countdown.follow(state);
    second();
    assert.deepEqual([countdown.counting, done], [false, []]);
  }
  countdown.follow("ready");
  assert.equal(countdown.left, 3);
  countdown.follow("ready");
  for (let more = 0; more < 3; more += 1) second();
  assert.deepEqual(done, ["start"]);
  countdown.whenPlaced(start);
  countdown.follow("failed");
  countdown.follow("ready");
  assert.equal(countdown.counting, false, "it was not placed");
  countdown.whenPlaced(start);
  assert.equal(countdown.key({ key: "Escape" }), true);
  countdown.follow("ready");
  assert.equal(countdown.counting, false, "called off on the way");
});
