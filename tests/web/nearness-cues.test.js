import assert from "node:assert/strict";
import { test } from "node:test";
import { closeness } from "../../app/web/js/endoscope/nearness-cues.js";

test("the cues rise over the last millimetre above the margin of what is nearest to its own", () => {
  const near = (clearance, margin) => ({ clearance_mm: clearance, margin_mm: margin });
  assert.equal(closeness([]), 0);
  assert.equal(closeness(undefined), 0);
  assert.equal(closeness([near(3, 0.5), near(10, 1)]), 0);
  assert.ok(Math.abs(closeness([near(0.75, 0.5), near(1.9, 1)]) - 0.75) < 1e-9);
  assert.deepEqual([closeness([near(0.5, 0.5)]), closeness([near(-2, 0.5)])], [1, 1]);
});
