import assert from "node:assert/strict";
import { test } from "node:test";
import { hold } from "../../app/web/js/hold.js";
import { keyEvent, layOutPage } from "./page.js";

layOutPage();

test("each change is told once", () => {
  const told = [];
  const { press, release } = hold(() => true, (down) => told.push(down));
  release();
  press(keyEvent("Space"));
  press(keyEvent("Space"));
  release();
  release();
  assert.deepEqual(told, [true, false]);
});

test("what is not allowed cannot be pressed, but is let go of all the same", () => {
  const told = [];
  let allowed = false;
  const { press, release } = hold(() => allowed, (down) => told.push(down));
  press(keyEvent("Space"));
  assert.deepEqual(told, []);
  allowed = true;
  press(keyEvent("Space"));
  allowed = false;
  release();
  assert.deepEqual(told, [true, false]);
});

test("a repeat of the key that holds it presses again, unless it is old or let go of", async () => {
  const told = [];
  const { press, release } = hold(() => true, (down) => told.push(down));
  const repeat = (fields) => press(keyEvent("Space", { repeat: true, ...fields }));
  repeat();
  press(keyEvent("Space"));
  repeat();
  repeat({ timeStamp: performance.now() - 200 });
  await new Promise((go) => { setTimeout(go, 5); });
  assert.deepEqual(told, [true, true]);
  repeat();
  release();
  await new Promise((go) => { setTimeout(go, 5); });
  assert.deepEqual(told, [true, true, false]);
});
