import assert from "node:assert/strict";
import { test } from "node:test";
import { colourOf, curveWords, placeWords } from "../../app/web/js/clearance-words.js";

const scale = { lo: 0, hi: 2, margin: 0.3, unknown: null, colours: ["#000000", "#ff0000", "#ffffff"] };

test("a clearance has the colour of the path there", () => {
  assert.equal(colourOf(-1, scale), "#000000");
  assert.equal(colourOf(0.5, scale), "#800000");
  assert.equal(colourOf(1, scale), "#ff0000");
  assert.equal(colourOf(9, scale), "#ffffff");
});

const bone = { name: "bone", margin_mm: 0.38, clearance_mm: [5, 1.234, 0.7] };
const profile = { s_mm: [0, 0.5, 1], curves: [bone], tissue_mm: [0, 18.6, 0.2], tissue_depth_mm: [0, 2.71, 0.1], registration_mm: null, sideways_mm: null };

test("a place says bone and soft tissue of the nearest pose", () => {
  assert.equal(placeWords({ profile }, 0.6), "At 0.6 mm: bone 1.23 mm; soft tissue 19 mm, 2.7 mm deep.");
  assert.equal(placeWords({ profile }, 7), "At 7.0 mm: bone 0.70 mm; no soft tissue.");
});

test("a place says how far sideways air leads round the tissue", () => {
  const passed = { ...profile, sideways_mm: [0, 2.14, 15] };
  assert.equal(placeWords({ profile: passed }, 0), "At 0.0 mm: bone 5.00 mm; no soft tissue.");
  assert.match(placeWords({ profile: passed }, 0.5), /; air leads round the tissue 2\.1 mm beside the tool\.$/);
  assert.match(placeWords({ profile: passed }, 1), /; air leads round the tissue 15 mm or more beside the tool\.$/);
});

test("behind a registration a place says what it may be off by", () => {
  const registered = { ...profile, registration_mm: [0.41, 0.42, 0.431] };
  assert.equal(placeWords({ profile: registered }, 1), "At 1.0 mm: bone 0.70 mm, and the registration may be off by 0.43 mm; no soft tissue.");
});

test("without a CT a place says nothing of soft tissue", () => {
  const bare = { ...profile, tissue_mm: null, tissue_depth_mm: null };
  assert.equal(placeWords({ profile: bare }, 0), "At 0.0 mm: bone 5.00 mm.");
});

test("every obstacle is told with its own clearance and margin, bone's first", () => {
  const curves = [bone, { name: "optic nerve", margin_mm: 1.2, clearance_mm: [2, 1.9, 1.31] }];
  assert.match(placeWords({ profile: { ...profile, curves } }, 1), /^At 1\.0 mm: bone 0\.70 mm, optic nerve 1\.31 mm;/);
  assert.deepEqual(curves.map(curveWords), ["bone, in the colours of the path; dashed: margin 0.38 mm", "optic nerve; dashed: margin 1.20 mm"]);
});
