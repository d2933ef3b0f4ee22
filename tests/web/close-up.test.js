// A chosen point of a registration is brought near in the slices, and the zoom from before comes back.
import assert from "node:assert/strict";
import { test } from "node:test";
import { CloseUp } from "../../app/web/js/slices/close-up.js";

/** A slice of 200 px that shows 200 mm at a zoom of 1. */
function pane(name) {
  const made = { name, zoom: 1, at: null, stage: { clientWidth: 300, clientHeight: 200 }, perPixel: () => 1 / made.zoom, zoomTo: (zoom) => { made.zoom = zoom; }, centre: (place) => { made.at = place; } };
  return made;
}

function opened() {
  const panes = [pane("axial"), pane("path")];
  const closeUp = new CloseUp(/** @type {any} */ ({ panes, zoomed: () => {} }));
  const choose = (id, position = [1, 2, 3]) => closeUp.heard(/** @type {any} */ ({ fiducials: { items: [{ id: "a", selected: id === "a", position }, { id: "b", selected: id === "b", position }] } }));
  return { panes, choose };
}

test("30 mm about the chosen point are shown, and as much as before once none is chosen", () => {
  const { panes: [axial, path], choose } = opened();
  choose("a");
  assert.ok(Math.abs(200 / axial.zoom - 30) < 1e-9);
  assert.deepEqual(axial.at, [1, 2, 3]);
  assert.deepEqual([path.zoom, path.at], [1, null], "the view across the path stays");
  choose("b", [4, 5, 6]);
  assert.deepEqual(axial.at, [4, 5, 6]);
  choose("");
  assert.equal(axial.zoom, 1);
});

test("what somebody zooms stays as it is, nearer and farther", () => {
  const { panes: [axial], choose } = opened();
  axial.zoom = 20;
  choose("a");
  assert.equal(axial.zoom, 20);
  choose("");
  choose("b");
  axial.zoom = 3;
  choose("");
  assert.equal(axial.zoom, 3);
});
