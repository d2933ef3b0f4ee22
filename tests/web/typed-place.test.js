// Numbers as they are typed and pasted: what is taken, what is missing, and what is wrong.
import assert from "node:assert/strict";
import { test } from "node:test";
import { numberOf, whyNoNumber } from "../../app/web/js/fields.js";
import { readPlace, threeIn } from "../../app/web/js/typed-place.js";

test("a number has a point or a comma, and nothing besides", () => {
  assert.deepEqual(["1", "-2.5", "−2.5", "3,25", " 4 ", "1e3"].map(numberOf), [1, -2.5, -2.5, 3.25, 4, 1000]);
  for (const text of ["", "abc", "205.239mm", "1 2", "1,2,3", "0x10", "Infinity", "--1"]) assert.ok(Number.isNaN(numberOf(text)), text);
});

test("what a field cannot take is said with its bounds", () => {
  assert.equal(whyNoNumber("0.3", 0.01, 50), "");
  assert.equal(whyNoNumber("0", 0.01, 50), "0.01 to 50 can be used.");
  assert.equal(whyNoNumber("-1", -0.5, 50), "−0.5 to 50 can be used.");
  assert.equal(whyNoNumber("?", 0, 1), "That is no number. 0 to 1 can be used.");
  assert.equal(whyNoNumber("", 0, 1), "Nothing is typed. 0 to 1 can be used.");
});

test("three numbers are a place, and three empty fields say nothing", () => {
  assert.deepEqual(readPlace(["1", "-2.5", "3,25"]).place, [1, -2.5, 3.25]);
  const { place, wrong, words } = readPlace(["", " ", ""]);
  assert.deepEqual([place, wrong, words], [null, [false, false, false], ""]);
});

test("one or two numbers are told as incomplete, and nonsense by its axis", () => {
  const half = readPlace(["1", "", ""]);
  assert.deepEqual([half.place, half.wrong.includes(true), half.words], [null, false, "y and z are missing."]);
  assert.equal(readPlace(["1", "2", ""]).words, "z is missing.");
  const bad = readPlace(["1", "abc", ""]);
  assert.deepEqual([bad.place, bad.wrong, bad.words], [null, [false, true, false], "y: ‘abc’ is no number."]);
  assert.equal(readPlace(["205.239mm", "2", "3"]).words, "x: ‘205.239mm’ is no number; leave the unit out.");
  assert.equal(readPlace(["1", "2", "1e9"]).words, "z: ‘1e9’ is too far away; 10000 mm at most.");
});

test("three numbers in one text are parted however they were copied", () => {
  for (const text of ["1 2 3", "1\t2\t3", "1, 2, 3", "1,2,3", "1;2;3", " 1; 2 ;3\n"]) assert.deepEqual(threeIn(text), ["1", "2", "3"], text);
  assert.deepEqual(threeIn("1,5; -2,5; 3,5"), ["1,5", "-2,5", "3,5"]);
  for (const text of ["205,2", "1 2", "1 2 3 4", "F1 1 2", "1,2,", ""]) assert.equal(threeIn(text), null, text);
});
