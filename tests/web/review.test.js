import assert from "node:assert/strict";
import { test } from "node:test";
import { errorAlongPath, leastClearance, overTime, sampleAt, segmentsAt, sideAt, speeds, timeAlong, tipSpeed } from "../../app/tabs/review/curves.js";
import { layOutElements } from "./panels.js";
import { signed } from "../../app/web/js/format.js";
import { duration, isUncertified, lastOf, millimetres, otherModes } from "../../app/web/js/runs.js";
import { capsule, tube } from "../../app/web/js/scene-layer/round-meshes.js";

layOutElements();
const { paired, pairsOf } = await import("../../app/tabs/review/pairs.js");
const { contentsOf } = await import("../../app/tabs/review/plots.js");
const { viewOf } = await import("../../app/web/js/run-views.js");
const { planesOf } = await import("../../app/tabs/review/path-plots.js");
const { CompareTable, FIGURES } = await import("../../app/tabs/review/compare.js");

/** @type {any} */
const SERIES = {
  run: "run-1", mode: "hands-on", certified: true, structures: ["bone", "nerve"], joints: [{ name: "q0", unit: "mm" }, { name: "q1", unit: "rad" }], radii_mm: [1],
  phases: ["free", "approach", "follow", "done", "inspect_approach", "inspect_hold"],
  t_s: [0.1, 0.2, 0.3, 0.5], tip: [[0, 0, 0], [0, 0, 1], [0, 0, 2], [0, 0, 2]],
  segments: [[[0, 0, 5, 0, 0, 0]], [[0, 0, 6, 0, 0, 1]], [[0, 0, 7, 0, 0, 2]], [[0, 0, 7, 0, 0, 2]]],
  side: [[0, 1, 0], [0, 0.8, 0.6], [0, 0.8, 0.6], [0, 0.8, 0.6]],
  speed: [[1, 2, 3, 4], [0, Math.PI, 0, 0]], clearance_mm: [[2, 1, null, null], [null, 3, null, 0.5]], reach_mm: [3, 3, 3, 3], nearest: [0, 0, -1, 1],
  force_n: [1, 2, 3, 4], error_mm: [5, 0.1, 0.4, 0.2], progress_mm: [0.1, 1.1, 1.2, 2.6], phase: [1, 2, 2, 3], held: [0, 0, 1, 0],
};

test("the tool stands between two samples on the straight line, and at the ends where they are", () => {
  assert.deepEqual([0, 0.1, 0.19, 0.2, 0.49, 9].map((t) => sampleAt(SERIES.t_s, t)), [0, 0, 0, 1, 2, 3]);
  const [[from, to]] = segmentsAt(SERIES, 0.15);
  assert.deepEqual([from, to].map((place) => place.map((value) => Number(value.toFixed(9)))), [[0, 0, 5.5], [0, 0, 0.5]]);
  assert.deepEqual(sideAt(SERIES, 0.15).map((value) => Number(value.toFixed(9))), [0, 0.9, 0.3]);
  assert.deepEqual(segmentsAt(SERIES, 0), [[[0, 0, 5], [0, 0, 0]]]);
  assert.deepEqual(segmentsAt(SERIES, 9), [[[0, 0, 7], [0, 0, 2]]]);
});

test("the error along the path is the largest of each half millimetre that was followed, over one axis for several runs", () => {
  const other = { ...SERIES, progress_mm: [null, 0.2, 2.7, 2.8], error_mm: [1, 2, 3, 4] };
  assert.deepEqual(errorAlongPath([SERIES, other]), { x: [0.25, 1.25, 2.75], lines: [[null, 0.4, 0.2], [2, null, 4]] });
  assert.equal(timeAlong(SERIES, 1.15), 0.2);
  assert.equal(timeAlong(SERIES, 99), 0.5);
});

test("series over time share an axis, and end where their run does", () => {
  const short = { ...SERIES, t_s: [0.1, 0.25], force_n: [7, 8] };
  const { x, lines } = overTime([SERIES, short], (/** @type {any} */ one) => one.force_n);
  assert.deepEqual(x, [0.1, 0.2, 0.25, 0.3, 0.5]);
  assert.deepEqual(lines, [[1, 2, 2, 3, 4], [7, 7, 8, null, null]]);
  assert.deepEqual(leastClearance(SERIES), [2, 1, null, 0.5]);
  assert.deepEqual(speeds(SERIES).map(({ name, values }) => [name, values[1]]), [["1", 2], ["2", 180]]);
  assert.deepEqual(tipSpeed(SERIES).map((value) => Math.round(value * 10) / 10), [0, 10, 10, 0]);
  assert.equal(speeds({ ...SERIES, joints: [], speed: [] })[0].name, "Tip");
});

test("a value over time is made once of each run, however many samples there are", () => {
  let made = 0;
  const long = { ...SERIES, t_s: [...Array(20_000).keys()] };
  overTime([long, SERIES], (/** @type {any} */ one) => {
    made += 1;
    return one.t_s;
  });
  assert.equal(made, 2);
});

test("pairs are plans driven in both modes, and have an interval from three on", () => {
  const run = (/** @type {string} */ id, /** @type {string} */ mode, /** @type {string | null} */ plan, completed = true) => /** @type {any} */ ({ id, mode, plan_id: plan, certified: mode !== "freehand", score: { completed, certified: mode !== "freehand", time_s: 1, error_mm: 0.01, contacts: 0 } });
  const runs = [run("a", "hands-on", "p"), run("b", "freehand", "p"), run("c", "freehand", "p"), run("d", "hands-on", "q"), run("e", "freehand", "q", false), run("f", "hands-on", null), run("g", "freehand", null)];
  assert.deepEqual(pairsOf(runs, "hands-on", "freehand").map((pair) => pair.map(({ id }) => id)), [["a", "b"]]);
  assert.equal(paired([1, 2]), null);
  const told = paired([1, 2, 3]);
  assert.equal(told?.mean, 2);
  assert.ok(Math.abs((told?.half ?? 0) - 4.3 / Math.sqrt(3)) < 1e-9);
  assert.deepEqual([signed(0.5, 1), signed(-0.5, 1), signed(0.01, 1)], ["+0.5", "−0.5", "0.0"]);
  assert.deepEqual(lastOf(runs, "freehand").map(({ id }) => id), ["g", "c", "b"]);
  const [other, ...more] = otherModes(runs, "hands-on");
  assert.deepEqual([other.id, more, viewOf(other).brief(other.score)], ["b", [], "1.0 s, 0.010 mm"]);
  assert.equal(isUncertified({ certified: false }), true);
  assert.equal(isUncertified(runs[0]), false);
});

test("durations and lengths have the digits that they deserve", () => {
  assert.deepEqual([4.25, 59.96, 125, null].map((one) => duration(one)), ["4.3 s", "60.0 s", "2:05 min", "–"]);
  assert.deepEqual([0.0123, 1.234, null].map((one) => millimetres(one)), ["0.012 mm", "1.23 mm", "– mm"]);
});

test("a capsule has its radius about its axis, a tube about its way", () => {
  const { positions, normals, indices } = capsule(2, 10);
  for (let at = 0; at < positions.length; at += 3) {
    const [x, y, z] = positions.subarray(at, at + 3);
    const off = z - Math.min(Math.max(z, 0), 10);
    assert.ok(Math.abs(Math.hypot(x, y, off) - 2) < 1e-5);
    assert.ok(Math.abs(Math.hypot(...normals.subarray(at, at + 3)) - 1) < 1e-5);
  }
  assert.ok(indices.length > 0 && Math.max(...indices) < positions.length / 3);
  /** @type {[number, number, number][]} */
  const way = [[0, 0, 0], [0, 0, 0.1], [0, 0, 5], [5, 0, 5]];
  const bent = tube(way, 0.3);
  assert.equal(bent.positions.length / 18, 3, "places that are too near are one");
  assert.ok([...bent.positions].every(Number.isFinite));
  assert.equal(tube([], 0.3).indices.length, 0);
  const back = tube([[0, 0, 0], [0, 0, 5], [0, 0, 0], [3, 0, 0]], 0.3); // in, and out the same way
  assert.ok([...back.positions, ...back.normals].every(Number.isFinite));
});

test("a difference of two modes says of how many plans it is", () => {
  const run = (/** @type {string} */ mode, /** @type {number} */ plan) => /** @type {any} */ ({ id: `${mode} ${plan}`, mode, plan_id: `${plan}`, score: { completed: true, certified: true, time_s: plan, error_mm: plan < 3 ? 0.01 * plan : null } });
  const runs = [0, 1, 2, 3].flatMap((plan) => [run("hands-on", plan), run("teleoperated", plan)]);
  const line = String(new CompareTable().pairs([{ run: runs[0], score: /** @type {any} */ ({}) }, { run: runs[1], score: /** @type {any} */ ({}) }], runs));
  assert.match(line, /Time 0.0 ± 0.0 s of 4 plans; Tip error, mean 0.000 ± 0.000 mm of 3 plans driven both ways/);
});

test("in plots and in the table a run says how it was driven, and that a distance is at least that", () => {
  const free = { ...SERIES, mode: "freehand", certified: false };
  assert.deepEqual(contentsOf(SERIES, free)[0].lines.map(({ name, caution }) => [name, caution]), [["Hands-on", undefined], ["Beside: Freehand", "without the certificate"]]);
  const inPlane = (/** @type {any} */ series) => ({ ...series, path_mm: [[0, 0], [9, 0]], flat_mm: series.t_s.map(() => [0, 0]), off_mm: series.t_s.map(() => 0) });
  for (const { lines } of planesOf(inPlane(free), inPlane(SERIES))) {
    assert.deepEqual(lines.filter(({ name }) => name !== "path").map(({ name, caution }) => [name, caution]), [["Beside: Hands-on", undefined], ["Freehand", "without the certificate"]]);
  }
  const scored = [0.5, 3].map((clearance) => /** @type {any} */ ({ run: {}, score: { least_clearance_mm: { bone: clearance }, reach_mm: 3 } }));
  const row = new CompareTable().row(/** @type {any} */ (FIGURES.find(({ name }) => name.startsWith("Nearest"))), scored);
  assert.match(String(row), /<td class="number">0.50<.*<td class="number">≥ 3.00</);
});
