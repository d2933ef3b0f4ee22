import assert from "node:assert/strict";
import { test } from "node:test";
import { layOutPage } from "./page.js";

/** What an element of a slice is asked for, drawn nowhere. */
class Element extends EventTarget {
  style = {};
  dataset = {};
  children = [];
  classList = { toggle: () => {} };
  clientWidth = 100;
  clientHeight = 100;
  append(...children) { this.children.push(...children); }
  replaceChildren(...children) { this.children = children; }
  setAttribute() {}
  getContext() { return { transferFromImageBitmap: (bitmap) => { this.shown = bitmap; }, scale: () => {} }; }
}

const { document } = layOutPage();
Object.assign(document, { createElement: () => new Element(), createElementNS: () => new Element() });
const posted = [];
Object.assign(globalThis, {
  devicePixelRatio: 1,
  ResizeObserver: class { observe() {} },
  requestAnimationFrame: (draw) => setTimeout(draw),
  Worker: class { postMessage(order) { posted.push(order); } },
});
const { pacing } = await import("../../app/web/js/frame-pacing.js");
const { marksOf } = await import("../../app/web/js/slices/marks.js");
const { AXES, Port } = await import("../../app/web/js/slices/port.js");
const { Pane } = await import("../../app/web/js/slices/pane.js");
const { ToolPoses } = await import("../../app/web/js/slices/tool-poses.js");
const { VolumeLink } = await import("../../app/web/js/slices/volume-link.js");

const plane = { position: 0, lo: -50, hi: 50, step: 1, columns: 1, rows: 1, origin: [0, 0, 0], u: [1, 0, 0], v: [0, 1, 0], detail: null };
const stateOf = (id) => ({ case: { id, detail: null }, slices: { window: 1, level: 0, planes: { axial: plane } } });
const settled = () => new Promise((resolve) => { setTimeout(resolve, 30); });

/** A slice of head `one`, whose voxels are there. */
function paneOfOne() {
  const link = new VolumeLink();
  const board = {
    link, state: stateOf("one"), middle: [0, 0, 0], crosshair: { place: [0, 0, 0] }, extent: () => [100, 100], holds: () => true, frames: null,
    greys: { values: {} }, outlines: { on: true }, second: { look: null }, measures: { shown: [] }, pose: null, placeField: {},
  };
  link.open("one", ["a"]);
  link.heard({ kind: "ready", head: link.head });
  posted.length = 0;
  const pane = new Pane("axial", board);
  return { pane, board, link };
}

/** The page goes to head `two`, as the slices do it. */
function goToTwo({ pane, board, link }) {
  board.state = stateOf("two");
  pane.forget();
  link.open("two", ["b"]);
}

const pictureOf = (head) => ({ head, width: 1, height: 1, closed: false, close() { this.closed = true; } });

for (const held of [false, true]) {
  test(`a picture of the head before is dropped, while ${held ? "something is held" : "nothing is held"}`, async () => {
    const shown = paneOfOne();
    const { pane, link } = shown;
    pane.refresh();
    const asked = posted.find(({ kind }) => kind === "draw");
    const old = pictureOf("one");
    pacing.held = held;
    link.heard({ kind: "drawn", head: asked.head, id: asked.id, bitmap: old, ms: 1 }); // it is there, and waits for its turn
    goToTwo(shown);
    await settled();
    pacing.held = false;
    assert.equal(pane.canvas.shown, undefined);
    assert.ok(old.closed);
    assert.equal(pane.port, null, "no mark either");
    assert.equal(pane.waiting.element.hidden, false);
    assert.equal(pane.waiting.words.textContent, "Loading …");
  });
}

test("before the new head's voxels are asked for, nothing is cut or read from those of the one before", async () => {
  const { pane, board } = paneOfOne();
  pane.refresh();
  const asked = posted.find(({ kind }) => kind === "draw");
  board.link.heard({ kind: "drawn", head: asked.head, id: asked.id, bitmap: pictureOf("one"), ms: 1 });
  await settled();
  posted.length = 0;
  board.state = stateOf("two");
  pane.refresh();
  pane.pointerInput.read();
  assert.deepEqual(posted, []);
});

test("the planner's picture of the head before is dropped", () => {
  const shown = paneOfOne();
  const { pane } = shown;
  goToTwo(shown);
  pane.loaded(plane, [new Element()], "one");
  assert.deepEqual([pane.pictures.children.length, pane.plane, pane.port], [0, null, null]);
  pane.loaded(plane, [new Element()], "two");
  assert.equal(pane.pictures.children.length, 1);
});

test("a grey value of the head before is not told", async () => {
  const shown = paneOfOne();
  const { pane, link } = shown;
  pane.port = pane.wanted();
  pane.pointerInput.read();
  const asked = posted.find(({ kind }) => kind === "read");
  link.heard({ kind: "values", head: asked.head, id: asked.id, values: [700] });
  goToTwo(shown);
  await settled();
  assert.deepEqual(pane.readings.map(({ textContent }) => textContent), ["", ""]);
});

test("a press of the head before adds nothing to the plan of the next one", async () => {
  const shown = paneOfOne();
  const sent = [];
  Object.assign(shown.board, { adds: true, connection: { send: (type) => sent.push(type) } });
  shown.board.state.step = { input: "select" };
  shown.pane.port = shown.pane.wanted();
  shown.pane.pointerInput.clicked([0, 0, 0], { shift: false });
  goToTwo(shown);
  await new Promise((resolve) => { setTimeout(resolve, 300); });
  assert.deepEqual(sent, []);
});

test("what a threshold keeps in the head before is not tinted in the next one", () => {
  const { link } = paneOfOne();
  link.keep({ caseId: "two", runs: new Uint32Array(), step: 1 });
  assert.deepEqual(posted, []);
  link.keep({ caseId: "one", runs: new Uint32Array(), step: 1 });
  assert.equal(posted.length, 1);
});

test("the tool's poses of a plan that was left while they came are dropped", async () => {
  const poses = new ToolPoses();
  let arrive;
  globalThis.fetch = async () => ({ ok: true, json: () => new Promise((resolve) => { arrive = resolve; }) });
  const asked = poses.update({ plan: { id: "one", points: [], tool: "t" }, corridor: { state: "current", words: "", scale: null } });
  await settled();
  poses.update({ plan: null, corridor: null });
  arrive({ s_mm: [0], segments: [[]], radii_mm: [], margin_mm: 0 });
  await asked;
  assert.equal(poses.words, null);
});

test("the name of a nostril stands clear of the tools at the left", () => {
  document.createElementNS = () => Object.assign(new Element(), { setAttribute(name, value) { this[name] = value; } });
  const state = { step: { input: "edit" }, openings: { marked: true, items: [{ id: "r", name: "Right nostril", side: "right", position: [0, 0, 0], radius_mm: 5 }] } };
  const nameAt = (width) => marksOf(new Port(AXES.axial, [0, 0, 0], 1, width, 300), state, [0, 0, 0], []).find((mark) => mark.class === "slice-opening-name");
  assert.equal(nameAt(600)["text-anchor"], "end");
  const narrow = nameAt(200);
  assert.deepEqual([narrow["text-anchor"], Number(narrow.x)], ["middle", 100]);
  assert.ok(Number(narrow.y) < 150 - 7, "above its ring");
});
