// What is typed and pointed at in Route: a wrong value is said at its field and sent to nobody, and Escape ends a choice.
import assert from "node:assert/strict";
import { test } from "node:test";
import { connectionOf, layOutElements, layOutInputs } from "./panels.js";

const { document } = layOutElements();
Object.assign(globalThis, { localStorage: { getItem: () => null, setItem() {} }, ResizeObserver: class { observe() {} } });
const inputs = layOutInputs(document);
const { default: RoutePanel } = await import("../../app/tabs/route/panel.js");
const { whyNoPlace, whyNoRadii } = await import("../../app/tabs/route/contours.js");
const { radiiWords } = await import("../../app/tabs/route/radii-plot.js");

const ROUTE = { id: "r", name: "Route", revision: 1, locked: false, entry: [-3, 58, -13], end: null, links: null, length_mm: 28, radius_mm: 6, bound_mm: null, breathing_mm: 0, marks: [], mark_kinds: [], picking: "entry", moving: "" };
const CONTOURS = { chosen: 1, by_hand: 0, left_out: 0, words: "", items: [5, 20, 40].map((at_mm) => ({ at_mm, centre: [1, 2, at_mm], radii_mm: [12.46774], by_hand: false, cut_mm: 0, behind_mm: null })) };
const STATE = /** @type {any} */ ({ step: { name: "route" }, route: ROUTE, routes: { items: [] }, route_contours: CONTOURS, route_path: { state: "computing", offers: [] } });
const connection = connectionOf(STATE), sent = () => connection.sent.splice(0);
const panel = new RoutePanel(/** @type {any} */ ({ connection, keys: { shortcuts: [] } }));
panel.update(STATE);
const field = (/** @type {string} */ id) => inputs.get(id);

test("a wrong value is said at its field and sent to nobody", () => {
  const ids = ["route-links", "route-length_mm", "route-radius_mm", "route-bound", "contour-radius", "contour-centre", "polyp-seed"];
  for (const id of ids) {
    field(id).typed("abc");
    assert.match(field(id).said, /no number|Type a place/, id);
    panel.update(STATE);
    assert.notEqual(field(id).said, "", `${id}: it stays until it is put right`);
  }
  for (const id of ["route-length_mm", "route-radius_mm", "contour-radius"]) {
    field(id).typed("0");
    assert.match(field(id).said, /can be used/, id);
  }
  assert.deepEqual(sent(), []);
});

test("another contour has nothing of what was wrong at the one before", () => {
  field("contour-radius").typed("0");
  panel.update({ ...STATE, route_contours: { ...CONTOURS, chosen: 2 } });
  assert.deepEqual([field("contour-radius").said, field("contour-radius").value], ["", "12.5"]);
  panel.update(STATE);
});

test("what can be taken is sent, with the rest of the robot as it is", () => {
  field("route-radius_mm").typed("4,5");
  field("route-bound").typed("");
  field("contour-radius").typed("8 9 10");
  field("contour-centre").typed("R 3 P 58 I 13");
  assert.deepEqual(sent(), [
    ["route.robot", { links: null, length_mm: 28, radius_mm: 4.5 }], ["route.bound", { bound_mm: null }],
    ["route.contour.resize", { at_mm: 20, radii_mm: [8, 9, 10] }], ["route.contour.move", { at_mm: 20, to: [-3, 58, -13] }],
  ]);
});

test("radii are one, or three and more, each within its bounds; a place has three coordinates", () => {
  for (const text of ["12", "8 9 10", "8; 9; 10"]) assert.equal(whyNoRadii(text), "", text);
  assert.match(whyNoRadii("8 9"), /three and more/);
  assert.match(whyNoRadii("8 9 0"), /0.5 to 150/);
  assert.match(whyNoRadii(""), /Nothing is typed/);
  assert.match(whyNoRadii(Array(73).fill("9").join(" ")), /72 radii/);
  assert.equal(whyNoPlace("R 3 P 58 I 13"), "");
  assert.match(whyNoPlace("R 3 P 58"), /Type a place/);
});

test("Escape ends the choice of a place, and is nothing else's here", () => {
  const press = (/** @type {any} */ route) => {
    connection.state.route = route;
    return panel.key(/** @type {any} */ ({ key: "Escape" }));
  };
  assert.equal(press(ROUTE), true);
  assert.deepEqual(sent(), [["route.pick", { what: "" }]]);
  assert.equal(press({ ...ROUTE, picking: "" }), false);
  assert.deepEqual(sent(), []);
});

test("the plot says what is under the pointer", () => {
  const path = { s_mm: [0, 250], radius_mm: [10, 15.14], wall_mm: [9, 14.75] };
  assert.equal(radiiWords(path, 1), "At 250 mm: 15.1 mm, wall 14.8 mm");
  assert.match(radiiWords(path, null), /Point at the plot/);
});
