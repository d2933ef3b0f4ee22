// Which step of a registration is open, and the result of each in one line.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Guide, nextStep, partLine, stepLine } from "../../app/tabs/register/guide.js";

const beads = (/** @type {string[]} */ ...states) => states.map((state, n) => ({ id: `b${n}`, name: `F${n + 1}`, state }));
const pairs = (/** @type {number} */ count, /** @type {number} */ measured) => [...Array(count).keys()].map((n) => ({ id: `p${n}`, label: `F${n + 1}`, in_image: [n, 0, 0], measured: n < measured ? [n, 0, 0] : null, enabled: true }));
const fit = (/** @type {string} */ state, fields = {}) => ({ state, wrong: null, fre_mm: null, fle_source: "none", simulated: false, cautions: [], ...fields });
const registration = (fields = {}) => /** @type {any} */ ({
  id: "one", has_volume: true, beads: [], search: null, pairs: [], fit: fit("waiting"), errors: { rows: [] }, touched: null,
  calibration: { to: "patient", pointer: null, robot: null }, ...fields,
});
const fitted = (fields = {}) => registration({ beads: beads("confirmed"), pairs: pairs(5, 5), fit: fit("fitted", { fre_mm: 0.43, fle_source: "estimated", ...fields }), errors: { rows: [{ within_95_mm: 1.201 }, { within_95_mm: 1.853 }] } });
const outlier = { pair: "p2", label: "F3", certainty: "outlier" };

test("the next step is the first that is not done", () => {
  const next = (/** @type {any[]} */ ...all) => all.map((one) => nextStep(registration(one)));
  assert.deepEqual(next({}, { has_volume: false }, { beads: beads("rejected") }), ["beads", "points", "points"]);
  assert.deepEqual(next({ beads: beads("found", "confirmed"), pairs: pairs(1, 0) }, { beads: beads("found", "confirmed"), pairs: pairs(3, 1) }), ["beads", "points"]);
  assert.equal(nextStep(fitted()), "error");
  assert.equal(nextStep({ ...fitted(), pairs: pairs(5, 4) }), "points");
  assert.equal(nextStep(fitted({ wrong: outlier })), "fit");
  assert.equal(nextStep(fitted({ wrong: { ...outlier, certainty: "suspect" } })), "error");
  assert.deepEqual(["misfit", "degenerate", "given"].map((state) => nextStep({ ...fitted(), fit: /** @type {any} */ (fit(state)) })), ["fit", "fit", "error"]);
});

test("the next step opens by what is done in this window, until somebody opens one", () => {
  const guide = new Guide();
  const found = registration({ beads: beads("found"), pairs: [] }), measured = registration({ pairs: pairs(3, 0) });
  assert.equal(guide.follow(found, null, false), "beads");
  assert.equal(guide.follow(measured, null, false), null); // by another window
  assert.deepEqual([guide.open, guide.marked], ["beads", "points"]);
  guide.acted = true;
  assert.equal(guide.follow(fitted(), null, true), null); // somebody types
  assert.equal(guide.follow(measured, null, false), "points");
  assert.equal(guide.follow(fitted(), null, false), "error");
  assert.equal(guide.marked, "use");
  guide.choose("points", true);
  assert.equal(guide.follow(fitted({ wrong: outlier }), null, false), null);
  assert.deepEqual([guide.open, guide.marked], ["points", "fit"]);
  guide.choose("use", true);
  guide.follow(fitted(), /** @type {any} */ ({ here: true, state: "ready" }), false);
  assert.deepEqual([guide.open, guide.marked], ["use", ""]);
  assert.equal(guide.follow({ ...measured, id: "other" }, null, false), "points");
  guide.follow(null, null, false);
  assert.equal(guide.open, "");
});

test("a closed step is one line with its result", () => {
  const lines = (/** @type {any} */ one, /** @type {any} */ use = null) => /** @type {const} */ (["beads", "points", "fit", "error", "use"]).map((name) => stepLine(name, one, use)).map(({ words, mark }) => (mark ? `${words} [${mark}]` : words));
  assert.deepEqual(lines(registration()), ["None", "None", "Needs 3 points", "Needs a fit", "No plan open"]);
  assert.deepEqual(lines(registration({ search: {}, fit: fit("misfit") }), { state: "none" }), ["None found [caution]", "None", "Points do not fit [caution]", "Needs a fit", "Not used"]);
  assert.deepEqual(lines(fitted(), { state: "ready", here: true }), ["1 of 1 confirmed [done]", "5 of 5 measured [done]", "FRE 0.43 mm [done]", "95 % within 1.86 mm [done]", "In use [done]"]);
  assert.deepEqual(lines(fitted({ wrong: outlier, simulated: true }), { state: "deleted" }).slice(1, 3), ["5 of 5 simulated [done]", "Wrong: ‘F3’ [caution]"]);
  assert.equal(stepLine("fit", fitted({ cautions: ["Few points."] }), null).mark, "caution");
  assert.deepEqual([registration({ pairs: pairs(2, 2) }), registration({ pairs: pairs(3, 3) }), { ...fitted(), pairs: pairs(2, 2) }].map((one) => stepLine("points", one, null).mark), ["", "", ""]);
  assert.equal(stepLine("use", fitted(), /** @type {any} */ ({ state: "deleted" })).words, "Cannot be used");
  assert.equal(stepLine("use", fitted(), /** @type {any} */ ({ state: "ready", here: false, name: "Other" })).words, "‘Other’ in use");
  const refined = { ...fitted(), fit: fit("refined", { fre_mm: 0.5 }), errors: { rows: [] } };
  assert.deepEqual(lines(refined, { state: "ready", here: true }).slice(3), ["Unknown [caution]", "In use, error unknown [caution]"], "as the card says");
  const simulated = { ...fitted({ simulated: true, cautions: ["Simulated."] }), pairs: pairs(5, 5).map((pair) => ({ ...pair, measured_from: "simulated" })) };
  assert.deepEqual(lines(simulated).slice(1, 4), ["5 of 5 simulated [done]", "FRE 0.43 mm [done]", "95 % within 1.86 mm [done]"], "a simulated touch is no doubt of the fit");
  assert.equal(stepLine("fit", { ...simulated, fit: { ...simulated.fit, cautions: ["Simulated.", "Three points."] } }, null).mark, "caution");
  assert.equal(stepLine("error", fitted({ wrong: outlier }), null).mark, "caution");
  assert.deepEqual(lines(refined).slice(2, 4), ["Refined, FRE 0.50 mm [done]", "Unknown [caution]"]);
  assert.equal(stepLine("points", { ...fitted(), pairs: [...pairs(3, 2), { .../** @type {any} */ (pairs(1, 1)[0]), enabled: false }] }, null).words, "2 of 3 measured, 1 left out");
});

test("what is rare says what it holds", () => {
  const part = (/** @type {any} */ name, state = {}) => partLine(name, /** @type {any} */ (state)).words;
  assert.deepEqual([part("registrations"), part("registrations", { registrations: { items: [{ deleted: false }, { deleted: true }] } })], ["None", "1 saved"]);
  assert.deepEqual([part("calibration"), part("calibration", { registration: registration() })], ["", "to the patient"]);
  assert.equal(part("refine", { registration: registration({ touched: { count: 60, refinement: null } }) }), "60 points touched");
  assert.equal(part("refine", { registration: registration({ touched: { count: 60, refinement: { moved_mm: 0.412 } } }) }), "Moved by 0.41 mm");
});
