import assert from "node:assert/strict";
import { test } from "node:test";
import { placeBeside } from "../../app/web/js/popover.js";

const VIEW = { width: 1000, height: 700 };
const SIZE = { width: 200, height: 300 };
const box = (left, top, width = 30, height = 30) => ({ left, top, right: left + width, bottom: top + height });

test("a popover stands at the first side with room, and within the window", () => {
  assert.deepEqual(placeBeside(box(700, 100), SIZE, VIEW, ["right", "left"]), { x: 736, y: 100 });
  assert.deepEqual(placeBeside(box(900, 100), SIZE, VIEW, ["right", "left"]), { x: 694, y: 100 });
  assert.deepEqual(placeBeside(box(900, 600), SIZE, VIEW, ["above", "below"]), { x: 792, y: 294 }, "moved in from the right");
  assert.deepEqual(placeBeside(box(100, 200), SIZE, VIEW, ["above", "below"]), { x: 100, y: 236 });
  assert.deepEqual(placeBeside(box(0, 0, 1000, 700), SIZE, VIEW, ["left", "above"]), { x: 8, y: 8 }, "the last one where none has room");
});
