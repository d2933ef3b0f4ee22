// Who writes the words of the scene: the planner hears of it whichever is there first, the frame or the connection.
import assert from "node:assert/strict";
import { test } from "node:test";
import { pacing } from "../../app/web/js/frame-pacing.js";
import { SceneFrame, hasErrorBalls } from "../../app/web/js/scene.js";
import { SceneHooks } from "../../app/web/js/scene-layer/hooks.js";
import { noted } from "./page.js";

function frame(connected) {
  const connection = Object.assign(noted(), { connected });
  return Object.assign(Object.create(SceneFrame.prototype), { connection, layer: {} });
}

test("who writes the words is not said into nothing, but with the connection that comes later", () => {
  const scene = frame(false);
  scene.sayWhoWrites();
  assert.deepEqual(scene.connection.sent, []);
  scene.connection.connected = true;
  scene.sayWhoWrites();
  assert.deepEqual(scene.connection.sent, [["view.labels", { by_page: true }]]);
});

test("where the canvas is not reached, viser writes", () => {
  const scene = frame(true);
  scene.layer = null;
  scene.sayWhoWrites();
  assert.deepEqual(scene.connection.sent, [["view.labels", { by_page: false }]]);
});

test("the legend names balls of the registration's error only where they are drawn", () => {
  const shown = (name, rest) => hasErrorBalls(/** @type {any} */ ({ step: { name }, plan: { targets: [{}] }, ...rest }));
  assert.equal(shown("plan", { plan_use: { state: "ready", error_words: "Nothing is known of the error.", has_balls: false } }), false);
  assert.equal(shown("plan", { plan_use: { state: "ready", error_words: "The error is below 1 mm.", has_balls: true } }), true);
  assert.equal(shown("rehearse", { plan_use: { has_balls: true } }), false);
});

test("a scene that rests is drawn for a view that is asked for", () => {
  const scene = Object.assign(frame(true), { rests: true, drawn: 0, layer: { turning: { reset() {} } }, drawOnce() { this.drawn += 1; } });
  scene.look("front");
  assert.equal(scene.drawn, 1);
  scene.rests = false;
  scene.look("front");
  assert.equal(scene.drawn, 1);
});

test("a paused scene is drawn again when another size has emptied its canvas", () => {
  const drawn = [], gl = { render: (what) => drawn.push(what), setSize() {} };
  const scene = { traverse() {}, __r3f: { root: { getState: () => ({ gl, camera: {}, setFrameloop() {}, invalidate() {} }) } } };
  const hooks = new SceneHooks(scene);
  gl.setSize(10, 10);
  assert.deepEqual(drawn, []);
  hooks.draw(false);
  gl.setSize(20, 20);
  assert.deepEqual(drawn, [scene]);
});

test("without a graphics card the scene rests while a hand drives: a long frame would cost the hand its hold", () => {
  for (const [held, tookMs, drawn] of [[true, 300, 0], [true, null, 0], [true, 20, 1], [false, 300, 1]]) {
    const scene = Object.assign(frame(true), { drawn: 0, layer: { hooks: { tookMs } }, rests: { textContent: "" }, drawOnce() { this.drawn += 1; } });
    globalThis.document = /** @type {any} */ ({ getElementById: () => scene.rests });
    pacing.held = Boolean(held);
    scene.drawAgain();
    assert.equal(scene.drawn, drawn);
    assert.equal(scene.rests.textContent, drawn ? "3D is drawn every 2 s." : "3D waits while you drive.");
  }
  pacing.held = false;
});

test("a paused scene whose last frame is shown as a copy is not drawn for another size", () => {
  const drawn = [], gl = { render: (what) => drawn.push(what), setSize() {} };
  const scene = { traverse() {}, __r3f: { root: { getState: () => ({ gl, camera: {}, setFrameloop() {}, invalidate() {} }) } } };
  const hooks = Object.assign(new SceneHooks(scene), { copied: {} });
  hooks.draw(false);
  gl.setSize(20, 20);
  assert.deepEqual(drawn, []);
});
