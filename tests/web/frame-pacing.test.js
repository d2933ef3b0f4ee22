import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { FramePacing } from "../../app/web/js/frame-pacing.js";

const FRAME_MS = 16;
let now, timers, pacing;

/** A clock of its own: frames are due with the next multiple of FRAME_MS, and drawing takes what it takes of it. */
function begin() {
  now = 0;
  timers = [];
  const later = (run, ms) => { timers.push({ at: now + ms, run }); };
  pacing = new FramePacing({ now: () => now, later, frame: (draw) => later(() => draw(now), FRAME_MS - (now % FRAME_MS)) });
}

beforeEach(begin);

function runUntil(end) {
  for (;;) {
    timers.sort((a, b) => a.at - b.at);
    if (!timers.length || timers[0].at > end) break;
    const { at, run } = timers.shift();
    now = Math.max(now, at);
    run();
  }
  now = Math.max(now, end);
}

/** Draw all the time for a second, each frame so long; returns [begin, end] of each. */
function drawnFor(tookMs, share = () => 1) {
  const frames = [];
  const draw = () => {
    const began = now;
    now += tookMs * share();
    frames.push([began, now]);
    pacing.request(draw);
  };
  pacing.request(draw);
  runUntil(1000);
  return frames;
}

const busy = (frames) => frames.reduce((sum, [began, ended]) => sum + ended - began, 0) / frames.at(-1)[1];

test("nothing is held: every frame is drawn", () => {
  assert.ok(busy(drawnFor(60)) > 0.75);
  assert.equal(pacing.scale, 1);
});

test("while something is held the thread is free for half of the time, however slow drawing is", () => {
  for (const tookMs of [12, 60, 300]) {
    begin();
    pacing.hold(true);
    const frames = drawnFor(tookMs);
    assert.ok(frames.length > 1);
    for (const [n, [began]] of frames.entries()) if (n) assert.ok(began - frames[n - 1][1] >= tookMs);
  }
});

test("what is drawn quickly is drawn at the rate of the screen", () => {
  pacing.hold(true);
  assert.ok(drawnFor(3).length > 55);
  assert.equal(pacing.scale, 1);
});

test("slow frames are coarse first, and rare only where that is not enough", () => {
  pacing.hold(true);
  const scales = [];
  pacing.addEventListener("scale", () => scales.push(pacing.scale));
  const frames = drawnFor(60, () => pacing.scale ** 2);
  assert.deepEqual(scales, [0.5]);
  assert.ok(frames.length > 25);
});

test("pictures are whole again a while after the hand let go, and stay coarse for one who taps", () => {
  pacing.hold(true);
  pacing.drawn(60);
  pacing.hold(false);
  runUntil(1000);
  pacing.hold(true);
  pacing.hold(false);
  runUntil(2500);
  assert.equal(pacing.scale, 0.5);
  runUntil(3500);
  assert.equal(pacing.scale, 1);
});

test("a frame that is cancelled is not drawn, in the window it was asked for and in one that keeps pace", () => {
  const drawn = [];
  const inner = { requestAnimationFrame: (draw) => timers.push({ at: now + FRAME_MS, run: () => draw(7) }), cancelAnimationFrame: (id) => drawn.push(`browser ${id}`) };
  pacing.adopt(inner);
  inner.cancelAnimationFrame(inner.requestAnimationFrame(() => drawn.push("cancelled")));
  pacing.cancel(pacing.request(() => drawn.push("cancelled")));
  inner.requestAnimationFrame((time) => drawn.push(time));
  inner.cancelAnimationFrame(4);
  runUntil(100);
  assert.deepEqual(drawn, ["browser 4", 7]);
});
