// Words at places of the scene: which of them are seen from where the camera stands.
import assert from "node:assert/strict";
import { test } from "node:test";
import { FakeElement, layOutElements } from "./panels.js";

layOutElements();
const { SceneLabels } = await import("../../app/web/js/scene-layer/labels.js");

/** As much of a vector of three.js as is asked for. */
class Place {
  constructor(x, y, z) { Object.assign(this, { x, y, z }); }

  clone() { return new Place(this.x, this.y, this.z); }

  sub({ x, y, z }) { return Object.assign(this, { x: this.x - x, y: this.y - y, z: this.z - z }); }

  dot({ x, y, z }) { return this.x * x + this.y * y + this.z * z; }

  normalize() { const long = Math.sqrt(this.dot(this)); return Object.assign(this, { x: this.x / long, y: this.y / long, z: this.z / long }); }

  distanceTo(other) { const off = this.clone().sub(other); return Math.sqrt(off.dot(off)); }
}

test("of beads behind the head only those are seen that lie in a lumen, through its wall", () => {
  const hooks = { watchers: new Set(), camera: { position: new Place(0, 0, 500) }, size: { width: 400, height: 300 }, world: (at) => new Place(...at), project: ([x, y]) => ({ x: 200 + x, y: 150 - y }) };
  Object.assign(FakeElement.prototype, { offsetWidth: 20, offsetHeight: 16 });
  const box = Object.assign(new FakeElement("div"), { parentElement: null }), labels = new SceneLabels(hooks, box);
  const letters = [[-100, 0, 0], [100, 0, 0]].map((position) => ({ kind: "letter", words: "R", position }));
  const beads = [["bead", 60], ["bead", -60], ["bead chosen", -60], ["bead inside", -60], ["bead inside", 60]].map(([kind, depth], index) => ({ kind, words: `${index}`, position: [-60 + 30 * index, 40, depth] }));
  labels.show([...letters, ...beads]);
  assert.deepEqual(box.children.slice(2).map(({ style }) => style.visibility), ["visible", "hidden", "visible", "visible", "visible"]);
});
