// The force on the hand as a tone: silent until it is switched on, below 0.2 N, and once no force is told any more.
import assert from "node:assert/strict";
import { test } from "node:test";
import { ForceSound, toneOf } from "../../app/web/js/endoscope/force-sound.js";
import { MeanForce } from "../../app/web/js/endoscope/guidance-arc.js";

test("a tone is nothing below 0.2 N, 220 Hz from there on, and 440 Hz from 2 N", () => {
  assert.equal(toneOf(0.19), null);
  assert.equal(toneOf(NaN), null);
  assert.equal(toneOf(0.2)?.hz, 220);
  assert.equal(toneOf(2)?.hz, 440);
  assert.equal(toneOf(7)?.hz, 440);
  assert.ok((toneOf(1)?.gain ?? 0) > (toneOf(0.3)?.gain ?? 0));
});

function heard() {
  const aimed = { hz: NaN, gain: 0 };
  const node = (part) => ({ frequency: { setTargetAtTime: (value) => { aimed.hz = value; } }, gain: { value: 0, setTargetAtTime: (value) => { aimed.gain = value; } }, connect: (other) => other, start() {}, part });
  let made = 0;
  const context = { currentTime: 0, destination: node("out"), createOscillator: () => node("tone"), createGain: () => node("gain"), resume() {} };
  const sound = new ForceSound(() => { made++; return context; });
  return { sound, aimed, made: () => made };
}

test("no sound is made before it is switched on, and none after it is switched off or nothing is told", (t) => {
  t.mock.timers.enable({ apis: ["setTimeout"] });
  const { sound, aimed, made } = heard();
  sound.hear(3);
  assert.equal(made(), 0);
  sound.turn(true);
  sound.hear(3);
  assert.ok(aimed.gain > 0);
  assert.equal(aimed.hz, 440);
  t.mock.timers.tick(1000);
  assert.equal(aimed.gain, 0);
  sound.hear(1);
  sound.turn(false);
  assert.equal(aimed.gain, 0);
  sound.hear(3);
  assert.equal(aimed.gain, 0);
});

test("a force is a mean over 30 ms, and over what was before where a clock begins anew", () => {
  const force = new MeanForce();
  force.push(0, 0, 0);
  force.push(3, 0, 0.03);
  assert.ok(Math.abs(force.mean[0] - 3 * (1 - Math.exp(-1))) < 1e-9);
  force.push(0, 1, 0.01);
  assert.deepEqual(force.mean, [0, 1]);
});
