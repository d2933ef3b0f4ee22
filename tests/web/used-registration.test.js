// What the Plan and Rehearse panels say of the registration that a plan goes by.
import assert from "node:assert/strict";
import { test } from "node:test";
import { usedWords } from "../../app/web/js/used-registration.js";

const ready = /** @type {any} */ ({ state: "ready", name: "Beads", error_words: "At ‘polyp’ the registration error is below 1.6 mm in 95 % of cases.", doubts: ["Simulated."], words: "" });
// Bone is nearest at 0 mm, but the nerve leaves less above its own margin at 41 mm.
const curves = [{ name: "bone", margin_mm: 0.3, clearance_mm: [1.2, 2, 3] }, { name: "nerve", margin_mm: 1.5, clearance_mm: [3, 2, 1.6] }];
const verdict = /** @type {any} */ ({ nearest: "nerve", nearest_mm: 41, nearest_curve: 1, profile: { s_mm: [0, 20, 41], curves, registration_mm: [0.7, 0.8, 0.94] } });

test("a registration is named with its error, where the path is narrowest and what is doubtful", () => {
  const [first, second] = usedWords(ready, verdict, false);
  assert.equal(first.words, "Uses ‘Beads’. At ‘polyp’ the registration error is below 1.6 mm in 95 % of cases. Where the path is narrowest, at 41 mm, it is below 0.94 mm.");
  assert.deepEqual([first.caution, second], [false, { words: "Simulated.", caution: true }]);
  assert.match(usedWords(ready, null, true)[0].words, /tells the robot where the patient lies/);
});

test("a plan without one says nothing, and one that cannot be used says why", () => {
  assert.deepEqual(usedWords({ ...ready, state: "none" }, verdict, true), []);
  assert.deepEqual(usedWords({ ...ready, state: "deleted", words: "It was deleted." }, null, true), [{ words: "It was deleted.", caution: true }]);
});
