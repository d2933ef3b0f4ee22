// What is told before a structure is deleted.
import assert from "node:assert/strict";
import { test } from "node:test";

const { madeOf, wayBack } = await import("../../app/tabs/patient/structure-words.js");

test("a structure comes back the way it came", () => {
  assert.match(wayBack("ct", false), /‘Threshold’/);
  assert.match(wayBack("segmentation", false), /file can be imported again/);
  assert.match(wayBack("painted", true), /label stays/);
  assert.match(wayBack("painted", false), /label is deleted/);
  for (const origin of ["ct", "painted"]) assert.doesNotMatch(wayBack(origin, true), /import/);
});

test("a painted structure belongs to its label", () => {
  assert.ok(madeOf("painted-12ab", "label-12ab"));
  assert.ok(!madeOf("painted-12ab", "label-12ac"));
  assert.ok(!madeOf("structure-12ab", "label-12ab"));
});
