import assert from "node:assert/strict";
import { test } from "node:test";
import { layOutElements } from "./panels.js";

layOutElements();
const kept = new Map();
Object.assign(globalThis, { localStorage: { getItem: (name) => kept.get(name) ?? null, setItem: (name, value) => kept.set(name, value) } });
const { ToolWindow, WindowSwitch } = await import("../../app/web/js/scene-layer/tool-window.js");

class Vector {
  constructor(x, y, z) { Object.assign(this, { x, y, z }); }
  copy({ x, y, z }) { return Object.assign(this, { x, y, z }); }
  applyMatrix4(shift) { return Object.assign(this, { z: this.z + shift }); }
}

const material = (own = () => {}) => ({ onBeforeCompile: own, customProgramCacheKey: () => "own", needsUpdate: false });
const compiled = (one) => {
  const shader = { uniforms: {}, fragmentShader: "void main() {\n#include <clipping_planes_fragment>\n}" };
  one.onBeforeCompile(shader);
  return shader;
};

function scene() {
  let drawn = 0;
  const hooks = { camera: { position: new Vector(0, 0, 0) }, watchers: new Set(), world: (place) => new Vector(...place), redraw: () => { drawn += 1; } };
  const surfaces = { now: { bone: { material: material() }, skin: null } };
  const opening = new ToolWindow(hooks, surfaces);
  const frame = () => hooks.watchers.forEach((watch) => watch({ matrixWorldInverse: -100 }));
  return { opening, surfaces, frame, draws: () => drawn };
}

test("bone and skin give way before the tip alone, each of their materials, beside what it did before", () => {
  const { opening, surfaces, frame } = scene();
  frame();
  assert.equal(surfaces.now.bone.material.needsUpdate, false, "without a drive nothing is compiled anew");
  opening.show([1, 2, 3]);
  frame();
  const shader = compiled(surfaces.now.bone.material);
  assert.match(shader.fragmentShader, /discard/);
  assert.deepEqual([shader.uniforms.vfixOpen.value, shader.uniforms.vfixTip.value.z], [1, -97]);
  assert.equal(surfaces.now.bone.material.customProgramCacheKey(), "vfix-window own");
  let own = 0;
  surfaces.now.skin = { material: material(() => { own += 1; }) };
  surfaces.now.bone = { material: material() }; // another opacity
  frame();
  assert.match(compiled(surfaces.now.skin.material).fragmentShader, /discard/);
  assert.ok(own > 0);
  assert.match(compiled(surfaces.now.bone.material).fragmentShader, /discard/);
});

test("it is closed without a tip, and is drawn anew then", () => {
  const { opening, frame, draws } = scene();
  opening.show(null);
  assert.equal(draws(), 0);
  opening.show([0, 0, 0]);
  frame();
  opening.show(null);
  assert.deepEqual([opening.uniforms.vfixOpen.value, draws()], [0, 2]);
});

test("the switch is kept by the browser, and on at first", () => {
  const first = new WindowSwitch();
  let said = 0;
  first.addEventListener("change", () => { said += 1; });
  assert.equal(first.on, true);
  first.set(false);
  assert.deepEqual([said, new WindowSwitch().on], [1, false]);
});
