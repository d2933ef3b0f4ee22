import assert from "node:assert/strict";
import { test } from "node:test";
import { letterOf, placeOf, placeWords, readingWords, sideWords } from "../../app/web/js/slices/place-words.js";
import { AXES, Port } from "../../app/web/js/slices/port.js";

test("a place is told by its sides, with a true minus for HU alone", () => {
  assert.deepEqual(readingWords([-24.5, -10, 3.2], -310), ["R 24.5 A 10.0 S 3.2 mm", "−310 HU"]);
  assert.deepEqual(readingWords([24.5, 10, -3.2], null), ["L 24.5 P 10.0 I 3.2 mm", "outside the scan"]);
  assert.equal(sideWords(-0.01, 0), "L 0.0", "no side is invented by rounding");
  assert.equal(sideWords(-7.25, 2, 2), "I 7.25");
  assert.equal(placeWords([-24.5, -3, 12.14]), "R 24.5 A 3.0 S 12.1 mm");
});

test("typed places are understood in any order, and three numbers as R A S", () => {
  for (const words of ["R 24.5 A 10 S 3", "s3 a10 r24.5", "R 24.5, A 10.0, S 3 mm", "24.5 10 3", "24.5, 10, 3", "24,5 10 3", "R 24,5 A 10,0 S 3", "R 24,5, A 10, S 3", "L −24.5 P -10 I −3"]) {
    assert.deepEqual(placeOf(words), [-24.5, -10, 3], words);
  }
  assert.deepEqual(placeOf("L 1 P 2 I 3"), [1, 2, -3]);
  assert.deepEqual(placeOf("0 0 0"), [0, 0, 0]);
});

test("what says no place is refused with an example", () => {
  for (const words of ["", "R 1 A 2", "R 1 L 2 S 3", "1 2", "1 2 3 4", "R 1 A 2 S 3 x", "R 1 A 2 S 3 S 4"]) {
    assert.throws(() => placeOf(words), /R 24\.5 A 10 S 3/u, words);
  }
});

test("letters follow the direction", () => {
  assert.deepEqual([[1, 0, 0], [-0.8, 0.1, 0.2], [0, -1, 0], [0, 0.7, 0.6], [0, 0, 1], [0, 0, -1]].map(letterOf), ["L", "R", "A", "P", "S", "I"]);
});

test("a pixel's place and its projection are each other's inverse, and pixel centres are cut", () => {
  const port = new Port(AXES.coronal, [4, -9, 30], 0.25, 200, 120);
  assert.deepEqual(port.place(100, 60), [4, -9, 30]);
  assert.deepEqual(port.place(104, 56), [5, -9, 31]);
  const { x, y, away } = port.project([5, -7, 31]);
  assert.deepEqual([x, y, away], [104, 56, 2]);
  const raster = port.raster(2);
  assert.deepEqual([raster.width, raster.height], [400, 240]);
  assert.deepEqual(raster.start, port.place(0.25, 0.25));
  assert.deepEqual([raster.u, raster.v], [[0.125, 0, 0], [0, 0, -0.125]].map((way) => way.map((part) => part + 0)));
});
