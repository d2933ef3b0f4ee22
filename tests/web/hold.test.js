import assert from "node:assert/strict";
import { test } from "node:test";
import { hold } from "../../app/web/js/hold.js";

test("each change is told once", () => {
  const told = [];
  const { press, release } = hold(() => true, (down) => told.push(down));
  release();
  press();
  press();
  release();
  release();
  assert.deepEqual(told, [true, false]);
});

test("what is not allowed cannot be pressed, but is let go of all the same", () => {
  const told = [];
  let allowed = false;
  const { press, release } = hold(() => allowed, (down) => told.push(down));
  press();
  assert.deepEqual(told, []);
  allowed = true;
  press();
  allowed = false;
  release();
  assert.deepEqual(told, [true, false]);
});
