import assert from "node:assert/strict";
import { test } from "node:test";
import { renderAnew, whenChanged } from "../../app/web/js/dom.js";

test("what did not change is rendered after a refusal alone", () => {
  const changed = whenChanged();
  let stored = "left";
  const control = { value: "" };
  const update = () => changed([stored], () => { control.value = stored; });
  update();
  control.value = "right"; // by the hand at the control, and refused
  update();
  assert.equal(control.value, "right");
  renderAnew(update);
  assert.equal(control.value, "left");
  stored = "midline";
  assert.throws(() => renderAnew(() => { throw new Error("no"); }));
  update();
  update();
  assert.equal(control.value, "midline");
});
