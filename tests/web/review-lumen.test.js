// Runs of a snake robot in a lumen in Review: what is plotted, where the robot stands, and what its score says.
import assert from "node:assert/strict";
import { test } from "node:test";
import { layOutElements } from "./panels.js";

layOutElements();
Object.assign(globalThis, { localStorage: { getItem: () => null, setItem() {} } });
const { robotAt } = await import("../../app/tabs/review/curves.js");
const { contentsOf } = await import("../../app/tabs/review/plots.js");
const { heldWords, lumenContents } = await import("../../app/tabs/review/lumen-plots.js");
const { lumenFigures } = await import("../../app/tabs/review/lumen-figures.js");
const { CompareTable } = await import("../../app/tabs/review/compare.js");
const { drivenOf, viewOf, withScore } = await import("../../app/web/js/run-views.js");
const { endName } = await import("../../app/web/js/lumen-score.js");
const { holdLines, holdList, itemList } = await import("../../app/web/js/run-score.js");
const { drivenAs } = await import("../../app/web/js/runs.js");

/** Two links of 10 mm that turn from straight ahead to the side. @type {any} */
const SERIES = {
  run: "a", world: "snake", arm: "manual", certified: false, limits: ["", "bound", "end"], radius_mm: 6, t_s: [0.1, 0.2],
  chain_mm: [[[0, 0, 0], [0, 0, 10], [0, 0, 20]], [[0, 0, 2], [0, 0, 12], [10, 0, 12]]],
  eye: [[0, 0, 26], [16, 0, 12]], shaft: [[0, 0, 1], [1, 0, 0]], side: [[0, 1, 0], [0, 1, 0]], depth_mm: [20, 22], speed_mm_per_s: [0, 20],
  deviation_mm: [null, 6.2], bound_mm: [null, 8], link: [0, 2], beyond_mm: [null, -1.8], distal_mm: [0, 6.2], bend: [0, 0.5], force_n: [0, 2], guidance_n: [0, 1.5], guidance_xy_n: [[null, null], [1.5, 0]], resistance_xy_n: [[null, null], [0, -0.5]],
  held: [0, 1], limit: [0, 1], limit_link: [0, 2],
};
/** @type {any} */
const SCORE = {
  world: "snake", arm: "manual", certified: false, completed: false, time_s: 61, depth_mm: 412.4, length_mm: 824, reach_mm: 800, share: 0.5, insertion_s: 40, withdrawal_s: null,
  path_length_mm: 500, deviation: { episodes: 3, time_s: 2.5, longest_s: 1.5, length_mm: 10, depth_mm: { mean: 1, max: 6.25 } }, nearest_mm: { mean: 1, max: 7 }, bound_mm: 8, beyond_bound_mm: 1.26, behind_wall: { share: 0.296, depth_mm: 3.52, links_mm: 4.26 },
  force_n: { mean: 0.25, max: 3 }, held_s: 1, held_by: [], holds: [], task: { title: "Ten polyps", completed: false, rows: [{ name: "Polyps cleared", value: 7, unit: "of 10", digits: 0, worse: true }], lacking: "" },
};

test("the links keep their length between two samples, and end where the tip is", () => {
  for (const t of [0.1, 0.15, 0.2]) {
    const { segments, camera } = robotAt(SERIES, t);
    assert.equal(segments.length, 2);
    for (const [from, to] of segments) assert.ok(Math.abs(Math.hypot(...to.map((value, axis) => value - from[axis])) - 10) < 1e-9);
    assert.deepEqual(segments[1][1], segments[0][0]);
    assert.deepEqual(camera.shaft.map((value) => Math.round(1e6 * value) / 1e6), t === 0.15 ? [0.5, 0, 0.5] : t === 0.1 ? [0, 0, 1] : [1, 0, 0]);
  }
  const [[from, to]] = robotAt(SERIES, 0.2).segments;
  assert.deepEqual([from, to], [[0, 0, 12], [10, 0, 12]]);
  const { segments: [[, middle]] } = robotAt(SERIES, 0.15);
  assert.deepEqual(middle.map((value) => Number(value.toFixed(9))), [5, 0, 16]);
});

test("the forces on the hand are those of the sample before, and none where they were not recorded", () => {
  assert.deepEqual(robotAt(SERIES, 0.15).forces, { guidance: [0, 0], resistance: [0, 0] });
  assert.deepEqual(robotAt(SERIES, 0.2).forces, { guidance: [1.5, 0], resistance: [0, -0.5] });
});

test("depth, the link at its bound, bend, force and insertion are plotted, and what held is said", () => {
  const shown = lumenContents(SERIES, { ...SERIES, arm: "certified", certified: true });
  assert.deepEqual(shown.map(({ title }) => title), ["Depth", "Nearest to a bound", "Bend r", "Force on the hand", "Insertion"]);
  assert.deepEqual(shown[0].lines.map(({ name, caution }) => [name, caution]), [["Manual", "without the certificate"], ["Beside: Certified", undefined]]);
  assert.deepEqual(shown[1].curves.lines, [[null, 6.2], [null, 6.2], [null, 8]]);
  assert.deepEqual([0, 1].map((at) => shown[1].now(at)), ["no link inside", "6.2 of 8.0 mm, link 2"]);
  assert.deepEqual([0, 1].map((at) => shown[0].now(at)), ["20 mm", "held: link 2 at its bound"]);
  assert.equal(heldWords({ ...SERIES, limit_link: [0, 0], limit: [0, 2] }, 1), "held: the end of the way");
  assert.deepEqual([shown[4].signed, shown[0].signed], [true, undefined]);
  assert.throws(() => contentsOf(SERIES, null)); // those of a rigid tool are others
});

test("a plot in which nothing but zeros is held is left out, as of a run from a fixed base", () => {
  const still = { ...SERIES, depth_mm: [0, 0], speed_mm_per_s: [0, 0], force_n: [0, 0.001], guidance_n: [null, 0] };
  assert.deepEqual(lumenContents(still, null).map(({ title }) => title), ["Nearest to a bound", "Bend r"]);
  assert.deepEqual(lumenContents(still, SERIES).length, 5, "the run beside it has them");
});

test("polyps are listed by their numbers with when they were done, or that they were missed", () => {
  const items = [{ name: "Polyp 1", done_s: 41.04, share: 1 }, { name: "Polyp 2", done_s: null, share: 0 }], task = { ...SCORE.task, items };
  assert.deepEqual(viewOf(SCORE).items({ ...SCORE, task }), items);
  assert.deepEqual(viewOf(SCORE).items({ ...SCORE, task: null }), []);
  assert.deepEqual(viewOf({ world: "rigid" }).items({}), []);
  assert.match(String(itemList([{ name: "Label 1", done_s: null, share: 0.5 }], () => {})), /Label 1[^P]*50 % cut/u);
  assert.match(String(itemList(items, () => {})), /Polyp 1[^P]*41\.0 s[^P]*Polyp 2[^P]*missed/u);
});

test("a run says how many links its robot has", () => {
  const said = viewOf(SCORE).robot;
  assert.deepEqual([30, 1, null].map((links) => said({ links })), ["30 links", "1 link", ""]);
  assert.equal(viewOf({ world: "rigid" }).robot({ links: null }), "");
});

test("a score is said in rows, the task's last; what is beyond a bound stands out", () => {
  const facts = Object.fromEntries(viewOf(SCORE).facts(SCORE).map(({ name, value, worse }) => [name, worse ? `${value}!` : value]));
  assert.deepEqual(facts, {
    "Time driven": "1:01 min", Depth: "412 mm", "Share of the route": "50 %", "Time in": "40.0 s", Withdrawal: "not drawn out", Deviations: "3, 2.5 s", "Deviation, largest": "6.3 mm",
    "Nearest to a bound": "7.0 mm", "Bound, largest": "8.0 mm", "Beyond bound": "1.3 mm!", "Behind wall, links": "4.3 mm", "Behind wall, pathway": "30 %, 3.5 mm", "Path of the tip": "500 mm", "Hand force, mean": "0.25 N", "Hand force, largest": "3.0 N", Held: "1.0 s",
    "Polyps cleared": "7 of 10!",
  });
  assert.equal(viewOf(SCORE).facts({ ...SCORE, beyond_bound_mm: 0, task: null }).find(({ name }) => name === "Beyond bound")?.value, "0 mm");
});

test("beside a certificate stands how much of the pathway is behind the wall, how deep, and the bound", () => {
  const { certificate } = viewOf(SCORE), sure = { ...SCORE, certified: true };
  assert.equal(certificate(SCORE), ""); // nothing was certified
  assert.equal(certificate(sure), "30\u00a0% of pathway behind wall, up to 3.5\u00a0mm · bound\u00a0≤\u00a08.0\u00a0mm");
  assert.equal(certificate(viewOf(SCORE).shortOf(sure)), certificate(sure)); // in lists
  assert.equal(certificate({ ...sure, behind_wall: null }), ""); // without the lumen's surface
  assert.equal(certificate({ ...sure, bound_mm: null }), "30\u00a0% of pathway behind wall, up to 3.5\u00a0mm");
  const moving = viewOf(SCORE).facts({ ...SCORE, behind_wall: { ...SCORE.behind_wall, links_mm: null } });
  assert.equal(moving.find(({ name }) => name === "Behind wall, links")?.value, "not measured");
});

test("the result comes first, and at most six figures are not folded", () => {
  const result = (/** @type {any} */ changed, end = "") => viewOf(SCORE).result({ ...SCORE, ...changed }, end);
  const task = { ...SCORE.task, result: "8 of 10 polyps viewed" };
  assert.equal(result({ task }), "8 of 10 polyps viewed · end not reached");
  assert.equal(result({ task: null }), "Came 412 of 824 mm");
  assert.equal(result({ task: null, completed: true, reach_mm: 824 }, "Splenic flexure"), "Reached the splenic flexure, 412 mm");
  assert.equal(result({ task, completed: true, reach_mm: 824 }), "8 of 10 polyps viewed · reached the end, 412 mm");
  const short = { completed: true, reach_mm: 412.4 };
  assert.equal(result({ task: null, ...short }, "Caecum"), "Came as deep as this robot can, 412 of 824 mm");
  const rows = ["Distance error", "Angle error", "Polyps missed"].map((name) => ({ name, value: 1, unit: "", digits: 0, worse: false }));
  for (const score of [{ ...SCORE, task: null }, { ...SCORE, task: { ...task, rows } }]) assert.equal(viewOf(score).facts(score).filter(({ folded }) => !folded).length, 6);
});

test("the end has the name of its landmark while the route is as it was driven", () => {
  const state = /** @type {any} */ ({ route: { id: "r", end: [1, 2, 3] }, route_path: { length_mm: 824.3 }, case: { landmarks: [{ name: "Anus", position: [0, 0, 0] }, { name: "Caecum", position: [1, 2, 3] }] } });
  assert.equal(endName(state, "r", SCORE), "Caecum");
  assert.equal(endName(state, "another", SCORE), "");
  assert.equal(endName({ ...state, route_path: { length_mm: 445 } }, "r", SCORE), "", "it was changed since");
});

test("holds by the computer are one line with their number and total", () => {
  const hold = (/** @type {string} */ kind, /** @type {string} */ reason, /** @type {number} */ held_s, t_s = 0) => /** @type {any} */ ({ kind, reason, duration_s: held_s + 0.2, held_s, t_s });
  const lines = holdLines([hold("planning", "waiting for the computer", 7, 3), hold("bound", "link 2 at its bound", 4), hold("planning", "what comes next was being planned", 5)]);
  assert.deepEqual(lines.map(({ words, length_s: length, hold: { t_s: at } }) => [words, length, at]), [["Waiting for the computer, 2 times", 12, 3], ["Link 2 at its bound", 4, 0]]);
  const many = [...Array(14).keys()].map((index) => hold("bound", `link ${index} at its bound`, 1));
  assert.match(String(holdList({ holds: many }, () => {})), /9 more in Review, 9\.0 s/);
  assert.doesNotMatch(String(holdList({ holds: many }, () => {}, null)), /in Review/, "there all are shown");
  assert.match(String(holdList({ holds: many }, () => {}, null)), /Link 13 at its bound/);
});

test("the times of a list of holds add up to the time held of the score: without interruptions, and with what was brief", () => {
  const hold = (/** @type {number} */ duration_s, /** @type {number} */ held_s) => /** @type {any} */ ({ kind: "bound", reason: "link 2 at its bound", t_s: 0, duration_s, held_s });
  const told = (/** @type {any[]} */ holds) => [...String(holdList({ holds }, () => {})).matchAll(/(\d+\.\d) s/g)].map(([, seconds]) => Number(seconds));
  assert.deepEqual(told([hold(1.9, 1.7)]), [1.7], "an interruption is no time held");
  assert.deepEqual(told([hold(1.9, 1.7), ...Array(10).fill(hold(0.02, 0.02))]), [1.7, 0.2]);
  assert.deepEqual(told([hold(0.02, 0.02)]), [], "nothing in tenths");
});

test("runs are compared by the same rows, and by those of a task that any of them has", () => {
  const rows = lumenFigures([{ ...SCORE, task: null }, SCORE]), value = (/** @type {string} */ name, /** @type {any} */ score) => rows.find((row) => row.name === name)?.of(score);
  assert.equal(value("Polyps cleared", SCORE), 7);
  assert.equal(value("Polyps cleared", { ...SCORE, task: null }), null);
  assert.equal(value("Deviation, largest", { ...SCORE, deviation: null }), null);
  const said = viewOf(SCORE).facts({ ...SCORE, withdrawal_s: 9 }).map(({ name }) => name), compared = rows.map(({ name }) => name);
  assert.deepEqual(said.filter((name) => name !== "Deviations" && !compared.includes(name)), [], "the table has the rows of the card");
});

test("more of what is bad is marked, and a longer withdrawal is not", () => {
  const marked = (/** @type {any} */ first, /** @type {any} */ second) => {
    const scored = [first, second].map((changed) => /** @type {any} */ ({ run: {}, score: { ...SCORE, withdrawal_s: 60, ...changed } }));
    return lumenFigures([SCORE]).filter((figure) => String(new CompareTable().row(figure, scored)).includes("worse")).map(({ name }) => name);
  };
  assert.deepEqual(marked({}, { time_s: 99, depth_mm: 500 }), ["Time driven"]);
  assert.deepEqual(marked({}, { depth_mm: 300 }), ["Depth"]);
  assert.deepEqual([marked({}, { withdrawal_s: 400 }), marked({}, { withdrawal_s: 30 })], [[], []]);
});

test("arms are compared over the routes on which both came to their end, that of the task where there is one", () => {
  const run = (/** @type {string} */ arm, /** @type {number} */ route) => /** @type {any} */ (withScore({ world: "snake", arm, mode: null, plan_id: `${route}`, score: null },
    { ...SCORE, arm, completed: true }));
  const runs = [0, 1, 2].flatMap((route) => [run("manual", route), run("guided", route)]), line = (/** @type {any[]} */ known) => String(new CompareTable().pairs([{ run: known[0], score: SCORE }, { run: known[1], score: SCORE }], known));
  assert.match(line(runs), /Time 0.0 ± 0.0 s of 3 routes driven both ways/);
  assert.match(line(runs.slice(0, 2)), /need three routes driven both ways; there is one\./);
});

test("a run is said by its arm, and a list has its short score", () => {
  assert.equal(drivenOf({ world: "snake drive" }), "lumen");
  assert.equal(drivenOf({ world: "freehand" }), "tool");
  assert.deepEqual([drivenAs({ mode: null, arm: "guided" }), drivenAs({ mode: "hands-on", arm: null }), drivenAs({})], ["guided", "hands-on", null]);
  const run = withScore({ world: "snake", score: null }, SCORE);
  assert.deepEqual(run.score, { certified: false, completed: false, time_s: 61, depth_mm: 412.4, deviation_mm: 7, beyond_bound_mm: 1.26, bound_mm: 8, behind_wall: SCORE.behind_wall, held_s: 1, task: "Ten polyps" });
  assert.equal(withScore({ world: "snake", score: null }, { ...SCORE, task: null, completed: true }).score?.completed, true);
  assert.equal(viewOf(run).short(run.score), "412\u00a0mm");
  assert.equal(viewOf(run).brief(run.score), "1:01 min, 412 mm");
});

test("a run from a fixed base, where nothing is inserted, says nothing of depth", () => {
  const still = { ...SCORE, depth_mm: null, length_mm: null, reach_mm: null, share: null, insertion_s: null, withdrawal_s: null };
  const names = viewOf(still).facts(still).map(({ name }) => name);
  assert.deepEqual(names.slice(0, 2), ["Time driven", "Deviations"]);
  const short = withScore(/** @type {any} */ ({ world: "snake", score: null }), still).score;
  assert.deepEqual([viewOf(still).short(short), viewOf(still).brief(short)], ["nearest to a bound 7.0\u00a0mm", "1:01 min"]);
  assert.equal(lumenFigures([still]).find(({ name }) => name === "Share of the route")?.of(still), null);
});
