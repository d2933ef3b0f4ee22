// The Register tab's words: what is known of a point, bars, orders.
import assert from "node:assert/strict";
import { test } from "node:test";
import { barScale, barShare, barWords, canPractise, exportWords, fleWords, importedWords, isReal, orderWords, pairWords, practiceWords, refinementRows, roundedUp, rowWords, touchedWords } from "../../app/tabs/register/words.js";

/** @param {object} fields */
const pair = (fields) => /** @type {any} */ ({ in_image: [1, 2, 3], measured: [4, 5, 6], enabled: true, measured_from: "typed", weight: 1, residual_mm: 0.3, ...fields });

test("a point says what is missing, how it was measured, and that it is left out", () => {
  assert.equal(pairWords(pair({ measured: null })), "not measured");
  assert.equal(pairWords(pair({ in_image: null })), "not in the CT yet");
  assert.equal(pairWords(pair({ measured_from: "simulated" })), "simulated");
  assert.equal(pairWords(pair({ enabled: false })), "typed, left out");
  assert.equal(pairWords(pair({ weight: 0.25 })), "typed, weight 0.25");
});

test("a bar is full at the largest residual, and small residuals do not look large", () => {
  assert.equal(barScale([pair({}), pair({ residual_mm: null })]), 1);
  assert.equal(barScale([pair({ residual_mm: 4 }), pair({})]), 4);
  assert.equal(barShare(0.3, 1), 0.3);
  assert.equal(barShare(null, 1), 0);
  assert.equal(barShare(9, 4), 1);
});

test("a simulated pointer is offered where nothing was measured", () => {
  const [open, played, typed] = [pair({ measured: null }), pair({ measured_from: "simulated" }), pair({})];
  assert.equal(canPractise([open, played]), true);
  assert.equal(canPractise([open, played, typed]), false);
  assert.equal(canPractise([]), false);
  assert.deepEqual([open, played, typed].map(isReal), [false, false, true]);
});

test("an error says where it is expected, and what it was computed from", () => {
  assert.equal(rowWords(/** @type {any} */ ({ label: "ostium", s_mm: null })), "ostium");
  assert.equal(rowWords(/** @type {any} */ ({ label: "", s_mm: 41.6 })), "Path, at 42 mm");
  assert.equal(fleWords(/** @type {any} */ ({ fle_mm: 0.5, fle_source: "stated", used: 5 })), "0.50 mm, as stated");
  assert.equal(fleWords(/** @type {any} */ ({ fle_mm: 0.312, fle_source: "estimated", used: 5 })), "0.31 mm, estimated");
  assert.equal(fleWords(/** @type {any} */ ({ fle_mm: null, fle_source: "none", used: 0 })), "unknown");
});

test("an order tells how many points it changes", () => {
  const moves = (/** @type {boolean[]} */ ...stays) => /** @type {any} */ ({ moves: stays.map((one) => ({ stays: one })) });
  assert.equal(orderWords(moves(false, false, true)), "2 points get another place, 1 stays");
  assert.equal(orderWords(moves(false, false)), "2 points get another place");
  assert.equal(orderWords(moves(true, true, true)), "As they are now");
});

test("a refinement tells first what judges it, and its residual last", () => {
  const touched = /** @type {any} */ ({ count: 60, measured_from: "simulated", structure: "bone", refinement: null });
  assert.equal(touchedWords(null, "Bone", true), "Nothing touched yet.");
  assert.equal(touchedWords(touched, "Bone", false), "60 points on Bone, simulated. Fit the points first.");
  assert.match(touchedWords(touched, "Bone", true), /Not refined yet/);
  assert.deepEqual(refinementRows(touched, /** @type {any} */ ({ fre_mm: 0.5 })), []);
  touched.refinement = { residual_mm: 0.071, kept: 45, moved_mm: 0.91, stability: 0.233 };
  const rows = refinementRows(touched, /** @type {any} */ ({ fre_mm: 1.073 }));
  assert.deepEqual(rows.map(([, words]) => words), ["1.07 mm rms", "0.91 mm", "0.23 of 1, held well", "0.07 mm rms, 45 of 60"]);
  assert.equal(refinementRows(touched, /** @type {any} */ ({ fre_mm: null }))[0][1], "none");
});

test("a bound is rounded up at the digits that are shown", () => {
  assert.deepEqual([0.7, 0.701, 1, 0.699].map(roundedUp), [0.7, 0.71, 1, 0.7]);
});

test("what goes out says where it leads, and what came in where its file says it does", () => {
  assert.match(exportWords("patient"), /points onto the patient\./);
  assert.match(exportWords("base"), /points to the robot's base\./);
  const came = (/** @type {object} */ fields) => importedWords(/** @type {any} */ ({ name: "A 2", to: "patient", fit: { simulated: false }, said: { to: "patient" }, ...fields }));
  assert.equal(came({}), "Read as ‘A 2’, to the patient. Add points to check it.");
  assert.match(came({ said: { to: null } }), /to the patient\. If not, choose otherwise/);
  assert.match(came({ to: "base", said: { to: "base" }, fit: { simulated: true } }), /to the robot's base\. Simulated: no patient/);
});

test("a bar says at which residual it is full", () => {
  assert.match(barWords(barScale([pair({ residual_mm: 4.1 })])), /full bar 4\.1 mm$/u);
  assert.match(barWords(barScale([pair({ residual_mm: 12.3 })])), /full bar 12 mm$/u);
});

test("where simulating went is told with what brings it back", () => {
  const simulated = pair({ measured_from: "simulated" });
  assert.equal(practiceWords([simulated]), "");
  assert.equal(practiceWords([pair({})]), "", "who measures has not practised");
  assert.match(practiceWords([simulated, pair({ label: "chin" })]), /^‘chin’ was measured\. .* ‘Forget’/u);
});

test("how far a surface holds against sliding is judged", () => {
  const held = (stability) => refinementRows(/** @type {any} */ ({ count: 60, refinement: { residual_mm: 0.1, kept: 45, moved_mm: 1, stability } }), /** @type {any} */ ({ fre_mm: 1 }))[2][1];
  assert.match(held(0.05), /^0.05 of 1, weak/u);
  assert.match(held(0.004), /may slide/u);
});
