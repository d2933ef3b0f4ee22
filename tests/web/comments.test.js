// The line of a comment: it is emptied once the comment is stored, and kept where it is not.
import assert from "node:assert/strict";
import { test } from "node:test";
import { layOutElements } from "./panels.js";

layOutElements();
const { sendLine } = await import("../../app/web/js/comments.js");

/** A field, and requests that the test answers. */
function line(value) {
  const field = { value, readOnly: false }, sent = [], answers = [];
  const send = () => sendLine(field, (text) => {
    sent.push(text);
    return new Promise((resolve) => { answers.push(resolve); });
  });
  return { field, sent, answers, send };
}

test("the field is emptied once the comment is stored; a second press before sends nothing", async () => {
  const { field, sent, answers, send } = line("  Too fast here ");
  const done = send();
  await send();
  assert.deepEqual([field.value, field.readOnly, sent], ["  Too fast here ", true, ["Too fast here"]]);
  answers[0](true);
  await done;
  assert.deepEqual([field.value, field.readOnly], ["", false]);
  await send();
  assert.equal(sent.length, 1, "nothing is no comment");
});

test("what was refused stays to be sent again", async () => {
  const { field, sent, answers, send } = line("Too fast here");
  const done = send();
  answers[0](false);
  await done;
  assert.deepEqual([field.value, field.readOnly, sent.length], ["Too fast here", false, 1]);
});
