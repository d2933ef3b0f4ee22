import assert from "node:assert/strict";
import { test } from "node:test";
import { Backoff } from "../../app/web/js/backoff.js";

test("the wait grows up to two seconds and stays there", () => {
  const backoff = new Backoff();
  assert.deepEqual(Array.from({ length: 6 }, () => backoff.next()), [250, 500, 1000, 2000, 2000, 2000]);
});

test("a connection that held begins with the shortest wait again, one that did not goes on", () => {
  const backoff = new Backoff();
  backoff.next();
  backoff.next();
  backoff.lost(9_999);
  assert.equal(backoff.next(), 1000);
  backoff.lost(10_001);
  assert.equal(backoff.next(), 250);
});
