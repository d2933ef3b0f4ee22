import assert from "node:assert/strict";
import { test } from "node:test";
import { LET_GO } from "../../app/web/js/keys.js";
import { layOutElements } from "./panels.js";

const { window } = layOutElements();
Object.assign(globalThis, { localStorage: { getItem: (/** @type {string} */ name) => (name.includes("scope-") ? "on" : null), setItem() {} } });
const { NearnessCues, closeness } = await import("../../app/web/js/endoscope/nearness-cues.js");

test("the cues rise over the last millimetre above the margin of what is nearest to its own", () => {
  const near = (clearance, margin) => ({ clearance_mm: clearance, margin_mm: margin });
  assert.equal(closeness([]), 0);
  assert.equal(closeness(undefined), 0);
  assert.equal(closeness([near(3, 0.5), near(10, 1)]), 0);
  assert.ok(Math.abs(closeness([near(0.75, 0.5), near(1.9, 1)]) - 0.75) < 1e-9);
  assert.deepEqual([closeness([near(0.5, 0.5)]), closeness([near(-2, 0.5)])], [1, 1]);
});

const RUNNING = { step: { name: "rehearse" }, rehearsal: { state: "running" }, nearness: [{ clearance_mm: 0.5, margin_mm: 0.5 }] };

/** Lets tones be made of parts that note the loudness that they are set to. */
function audio() {
  const heard = [];
  class Param { setTargetAtTime(value) { heard.push(value); } }
  class Node { frequency = new Param(); gain = { setTargetAtTime: (value) => heard.push(["gain", value]) }; connect(other) { return other; } start() {} }
  const made = [];
  class Context { state = "running"; currentTime = 0; async suspend() { this.state = "suspended"; } async resume() { this.state = "running"; } constructor() { made.push(this); } }
  Object.assign(globalThis, { AudioContext: Context, OscillatorNode: Node, GainNode: Node });
  return { made, loudness: () => heard.filter((one) => Array.isArray(one)).map(([, value]) => value).at(-1) };
}

test("a page that is hidden, left or disconnected is silent at once, and plays nothing any more soon after", async (context) => {
  context.mock.timers.enable({ apis: ["setTimeout"] });
  const { made, loudness } = audio(), cues = new NearnessCues();
  cues.update(RUNNING, true);
  assert.ok(loudness() > 0);
  window.dispatchEvent(new Event(LET_GO));
  assert.equal(loudness(), 0);
  assert.equal(cues.vignette.style.opacity, "0");
  for (let frame = 0; frame < 5; frame += 1) {
    cues.update(RUNNING, false);
    context.mock.timers.tick(300);
  }
  assert.equal(made[0].state, "suspended");
  cues.update(RUNNING, true);
  await null;
  assert.deepEqual([made[0].state, loudness() > 0], ["running", true]);
});

test("a machine that plays nothing stops no picture", (context) => {
  context.mock.method(console, "error", () => {});
  Object.assign(globalThis, { AudioContext: class { constructor() { throw new DOMException("no device", "NotSupportedError"); } } });
  const cues = new NearnessCues();
  cues.update(RUNNING, true);
  cues.update(RUNNING, true);
  assert.equal(cues.vignette.style.opacity, "1");
});
