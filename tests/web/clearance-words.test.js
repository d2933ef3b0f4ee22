import assert from "node:assert/strict";
import { test } from "node:test";
import { captionWords, colourOf, deepestOf, marginWords, placeDetail, placeWords, structureColour, topOf } from "../../app/web/js/clearance-words.js";

const scale = { lo: 0, hi: 2, margin: 0.3, unknown: null, colours: ["#000000", "#ff0000", "#ffffff"] };

test("a clearance has the colour of the path there", () => {
  assert.equal(colourOf(-1, scale), "#000000");
  assert.equal(colourOf(0.5, scale), "#800000");
  assert.equal(colourOf(1, scale), "#ff0000");
  assert.equal(colourOf(9, scale), "#ffffff");
});

const bone = { name: "bone", margin_mm: 0.38, clearance_mm: [5, 1.234, 0.7] };
const profile = { s_mm: [0, 0.5, 1], curves: [bone], exact_to_mm: 3, tissue_mm: [0, 18.6, 0.2], tissue_depth_mm: [0, 2.71, 0.1], registration_mm: null, sideways_mm: null };

test("a place says bone and soft tissue of the nearest pose", () => {
  assert.equal(placeWords({ profile }, 0.6), "At 1 mm: bone 1.23, tissue 19 mm");
  assert.equal(placeDetail({ profile }, 0.6), "Here the tool is 2.7 mm deep in soft tissue.");
  assert.equal(placeWords({ profile }, 7), "At 7 mm: bone 0.70, tissue 0 mm");
  assert.equal(placeDetail({ profile }, 7), "");
});

test("the detail of a place says how far sideways air leads round the tissue", () => {
  const passed = { ...profile, sideways_mm: [0, 2.14, 15] };
  assert.equal(placeDetail({ profile: passed }, 0), "");
  assert.match(placeDetail({ profile: passed }, 0.5), / Air leads round the tissue 2\.1 mm beside the tool\.$/);
  assert.match(placeDetail({ profile: passed }, 1), /^Air leads round the tissue 15 mm or more beside the tool\.$/);
});

test("behind a registration a place says what it may be off by", () => {
  const registered = { ...profile, registration_mm: [0.41, 0.42, 0.431] };
  assert.equal(placeWords({ profile: registered }, 1), "At 1 mm: bone 0.70, registration 0.43, tissue 0 mm");
});

test("without a CT a place says nothing of soft tissue", () => {
  const bare = { ...profile, tissue_mm: null, tissue_depth_mm: null };
  assert.equal(placeWords({ profile: bare }, 0), "At 0 mm: bone ≥ 5.00 mm");
});

const curves = [bone, { name: "optic nerve", margin_mm: 1.2, clearance_mm: [2, 1.9, 1.31] }];

test("every obstacle is told with its own clearance and margin, bone's first", () => {
  assert.match(placeWords({ profile: { ...profile, curves } }, 1), /^At 1 mm: bone 0\.70, optic nerve 1\.31,/);
  assert.deepEqual(curves.map(marginWords), ["margin 0.38 mm", "margin 1.20 mm"]);
});

test("a structure has the colour that it has in the head, also one whose core alone is hard", () => {
  const regions = [{ name: "optic nerve", colour: "#c97bd1" }, { name: "artery, 2 mm deep", colour: "#7fb069" }];
  assert.deepEqual(["optic nerve", "optic nerve, 1 mm deep", "artery, 2 mm deep"].map((name) => structureColour(name, regions)), ["#c97bd1", "#c97bd1", "#7fb069"]);
});

test("the plot is cut where clearance is not measured any more, above every margin", () => {
  assert.equal(topOf(profile), 3);
  assert.equal(topOf({ ...profile, curves: [bone, { ...bone, margin_mm: 3.5 }] }), 4);
});

test("depths have an axis of their own up to the greatest one", () => {
  assert.deepEqual([[0, 2.71, 0.1], [0, 14.2, 15], [0, 0.05, 0], null].map((depths) => deepestOf({ tissue_depth_mm: depths })), [3, 15, 0, 0]);
});

test("the caption names only what the plot shows", () => {
  const all = captionWords({ profile: { ...profile, curves, registration_mm: [1, 1, 1] }, nearest: "optic nerve" });
  for (const part of ["to bone", "protected structures", "Grey area", "Band about optic nerve"]) assert.ok(all.includes(part), part);
  const bare = captionWords({ profile: { ...profile, tissue_depth_mm: null }, nearest: "bone" });
  for (const part of ["protected structures", "Grey area", "Band"]) assert.ok(!bare.includes(part), part);
});
