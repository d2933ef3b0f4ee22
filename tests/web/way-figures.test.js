// Figures of suggested ways: those of their verdicts, in the same rows.
import assert from "node:assert/strict";
import { test } from "node:test";

const { figuresOf, rowsOf } = await import("../../app/tabs/plan/way-figures.js");

const figure = (name, value, fields = {}) => ({ name, value, level: "fits", s_mm: 0, whole_mm: null, digits: 2, ...fields });
const reach = figure("reach", 88.1, { whole_mm: 88.2, digits: 0 });
const tissue = figure("in soft tissue", 20.4, { digits: 0 });

test("a way has the figures of its verdict, and its length in place of its reach", () => {
  const bone = figure("bone", 0.934, { level: "tight" });
  const [first, second, length, ...more] = figuresOf({ figures: [bone, tissue, reach] });
  assert.deepEqual([first, second, more], [bone, tissue, []]);
  assert.deepEqual([length.name, length.value, length.whole_mm, length.digits], ["length", 88.2, null, 0]);
});

test("the rows of all ways are in one order, obstacles first, whatever is worst in each", () => {
  const ways = [
    { figures: [tissue, figure("bone", 1), reach] },
    { figures: [figure("Left orbit", 0.1), reach, figure("bone", 1), tissue, figure("registration error", 0.4)] },
  ];
  assert.deepEqual(rowsOf(ways), ["bone", "Left orbit", "in soft tissue", "registration error", "length"]);
});
