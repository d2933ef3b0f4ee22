// Which surfaces the slices' worker is asked for, and when again.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Outlines } from "../../app/web/js/slices/outlines.js";

const state = /** @type {any} */ ({ case: { id: "one", outlines: [{ surface: "bone", colour: "#fff", closed: true }] } });

test("surfaces are asked for once, and again for a link that opens anew or after they did not come", (context) => {
  context.mock.timers.enable({ apis: ["setTimeout"] });
  let asked = 0;
  const link = Object.assign(new EventTarget(), { head: 1, holds: () => true, outline: () => { asked += 1; } });
  const outlines = new Outlines(/** @type {any} */ (link));
  const asks = () => {
    outlines.ask(state);
    outlines.ask(state);
    return asked;
  };
  assert.equal(asks(), 1);
  link.head = 2;
  assert.equal(asks(), 2);
  link.dispatchEvent(new Event("unoutlined"));
  assert.equal(asks(), 2);
  context.mock.timers.tick(6000);
  assert.equal(asks(), 3);
});
