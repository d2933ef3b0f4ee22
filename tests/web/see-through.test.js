import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { PathThroughBone } from "../../app/web/js/scene-layer/see-through.js";

/** As much of a mesh of three.js as a second pass of it needs. */
class Mesh {
  isMesh = true;
  userData = {};
  children = [];
  parent = null;
  constructor(geometry, material) { Object.assign(this, { geometry, material }); }
  add(child) {
    this.children.push(child);
    child.parent = this;
  }
  removeFromParent() {
    this.parent.children = this.parent.children.filter((each) => each !== this);
    this.parent = null;
  }
}

function mesh(colour, count, transparent = false) {
  const color = { hex: colour, getHexString() { return this.hex; }, copy(other) { this.hex = other.hex; } };
  const material = { color, transparent, clone: () => ({ ...material, color: { ...color }, dispose() {} }) };
  return new Mesh({ attributes: { position: { count } } }, material);
}

const paletteColour = (name) => {
  const numbers = readFileSync(new URL("../../app/scene/palette.py", import.meta.url), "utf8").match(new RegExp(`^${name} = \\((\\d+), (\\d+), (\\d+)\\)`, "m"));
  return numbers.slice(1).map((each) => Number(each).toString(16).padStart(2, "0")).join("");
};

test("points and targets of the plan are drawn once more where bone hides them, and nothing else is", () => {
  const marks = ["ACCENT", "TARGET", "SELECTED"].map((name) => mesh(paletteColour(name), 960));
  const others = [mesh(paletteColour("BONE"), 400_000), mesh(paletteColour("ROBOT"), 900), mesh(paletteColour("SELECTED"), 5000), mesh(paletteColour("ACCENT"), 960, true)];
  let scene = [...marks, ...others];
  const hooks = { watchers: new Set(), each: (visit) => scene.flatMap((each) => [each, ...each.children]).forEach(visit) };
  const through = new PathThroughBone(hooks);
  const frame = () => hooks.watchers.forEach((watch) => watch());
  frame();
  frame();
  assert.deepEqual(scene.map(({ children }) => children.length), [1, 1, 1, 0, 0, 0, 0]);
  const [pass] = marks[1].children;
  assert.ok(pass.material.opacity < 1 && !pass.material.depthWrite && pass.visible);
  marks[1].material.color.hex = paletteColour("SELECTED");
  frame();
  assert.equal(pass.material.color.hex, "ffffff");
  through.shines = false;
  frame();
  assert.equal(pass.visible, false, "not through opaque skin");
  scene = others;
  frame();
  assert.equal(through.passes.size, 0);
});
