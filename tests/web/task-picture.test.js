// What the picture of a task says: what was done just now, and where the next label is.
import assert from "node:assert/strict";
import { mock, test } from "node:test";
import { layOutElements } from "./panels.js";

layOutElements();
const { DoneMarks, FRESH_MS } = await import("../../app/web/js/endoscope/done-marks.js");
const { LabelPointer, wayTo } = await import("../../app/web/js/endoscope/label-way.js");
const { TaskPicture } = await import("../../app/web/js/endoscope/task-picture.js");

const AHEAD = { eye: [0, 0, 0], right: [1, 0, 0], above: [0, 1, 0], ahead: [0, 0, 1] };
const label = (/** @type {any} */ centre, end_mm = -10) => /** @type {any} */ ({ centre, normal: [0, 0, -1], along: [1, 0, 0], end_mm });

test("what is done under the eyes has a tick for a moment, what was done before has none", () => {
  mock.timers.enable({ apis: ["setTimeout"] });
  const over = mock.fn(), marks = new DoneMarks(over), fresh = () => [...marks.fresh];
  marks.follow([true, false]);
  assert.deepEqual(fresh(), [], "a page that is opened in the middle of a task");
  marks.follow([true, true]);
  mock.timers.tick(FRESH_MS - 1);
  marks.follow([true, true]);
  assert.deepEqual(fresh(), [1]);
  mock.timers.tick(1);
  assert.deepEqual(fresh(), []);
  assert.equal(over.mock.callCount(), 1, "the picture is drawn without it");
  marks.follow([false, false]); // the next run
  assert.deepEqual(fresh(), []);
  marks.follow([true, false]);
  assert.deepEqual(fresh(), [0]);
  marks.follow([false, false]);
  assert.deepEqual(fresh(), [], "a replay that went back");
  mock.timers.reset();
});

test("while no label is in the picture, the way to the first one that is left is at its side", () => {
  assert.equal(wayTo(AHEAD, [label([0, 0, 50]), label([0, 0, -50])]), null, "one is in the picture");
  assert.deepEqual(wayTo(AHEAD, [label([50, 0, 10]), label([0, 90, 1])]), { number: 1, right: 1, down: -0, behind: false });
  assert.deepEqual(wayTo(AHEAD, [label([50, 0, 10], 10), label([0, 90, -10])]), { number: 2, right: 0, down: -1, behind: true }, "the first is done");
  assert.equal(wayTo(AHEAD, [label([0, 0, -50], 10)]), null, "none is left");
  assert.equal(wayTo(AHEAD, [label([34.9, 0, 50])]), null, "35° is the rim");
  assert.equal(wayTo(AHEAD, [label([35.2, 0, 50])])?.right, 1);
  assert.equal(wayTo(AHEAD, [label([0, 0, -50])])?.behind, true);
});

test("the arrow on the rim points to the side, with the label's number", () => {
  const pointer = new LabelPointer();
  pointer.show({ number: 3, right: -1, down: 0, behind: true });
  assert.equal(pointer.words.textContent, "Label 3, behind");
  assert.equal(pointer.words.attributes.get("text-anchor"), "start", "they begin beside it");
  assert.match(pointer.arrow.attributes.get("d"), /^M7\.5 50\.0L11\.5 /u, "its tip is on the left");
  pointer.show(null);
  assert.equal(pointer.element.hidden, true);
});

test("a polyp that is cleared is a tick, then a ring, and no ball any more; a label is a tick", () => {
  mock.timers.enable({ apis: ["setTimeout"] });
  const drawn = /** @type {any} */ ({ bumps: { all: [] }, labels: { set() {} }, overlay: { setDone(/** @type {any} */ done, /** @type {any} */ fresh) { Object.assign(drawn, { done, fresh }); } } });
  const picture = new TaskPicture(() => drawn, () => {}), polyps = (/** @type {boolean[]} */ ...cleared) => /** @type {any} */ ({
    polyps: cleared.map((one, index) => ({ at: [index, 0, 0], colour: 0, cleared: one })), radius_mm: 2, completed: false, frame_deg: 20, held_s: 0, hold_s: 7,
  });
  picture.show(polyps(false, false), null);
  assert.deepEqual([drawn.bumps.all.length, drawn.done, drawn.fresh], [2, [], []]);
  picture.show(polyps(false, true), null);
  assert.deepEqual([drawn.bumps.all.map(({ at }) => at), drawn.done, drawn.fresh], [[[0, 0, 0]], [], [[1, 0, 0]]]);
  mock.timers.tick(FRESH_MS);
  assert.deepEqual([drawn.done, drawn.fresh], [[[1, 0, 0]], []]);
  picture.show(null, null);
  picture.show(null, /** @type {any} */ ({ labels: [label([0, 0, 9])] }));
  picture.show(null, /** @type {any} */ ({ labels: [label([0, 0, 9], 10)] }));
  assert.deepEqual([drawn.done, drawn.fresh], [[], [[10, 0, 9]]], "at the arrow's tip");
  mock.timers.reset();
});
