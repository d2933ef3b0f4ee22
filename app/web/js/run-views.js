// What is said of a run, by what was driven: a rigid tool along its path, or a snake robot in a lumen.
import { fixed } from "./format.js";
import { endName, lumenCertificate, lumenFacts, lumenResult, shortOfLumen } from "./lumen-score.js";
import { factsOf } from "./run-score.js";
import { duration, millimetres, shortOf } from "./runs.js";
import { html, nothing } from "./template.js";

/** @import { Fact } from "./run-score.js" */
/** @import { AnyScore, AnyShort } from "./runs.js" */
/** @import { LumenScorePublic, ScorePublic, TaskItemPublic, ShortLumenScore, ShortScore, ViewModel } from "./types.js" */

/** @typedef {"tool" | "lumen"} Driven */
/**
 * of: what was driven, as a document; how: what runs of it differ by. done: that a run came to its end. facts: of a score.
 * certificate: figures beside a certified score. result: of a score in one line, '' where its figures say it. short: of a score that a list has, after the time; brief: the same in one line with it. robot: that was driven, '' where all are alike. items: of a task, such as its polyps. shortOf: of a score. learning: whether tip errors make a
 * learning curve, which a teacher's run may lead. laid: whether it can be laid into the scene. report: whether there is one to
 * print. formats: that it is exported in.
 * @typedef {{ of: string, how: string, done: string, facts: (score: any) => Fact[], certificate: (score: any) => string, result: (score: any, end?: string) => string, short: (score: any) => string, brief: (score: any) => string, robot: (run: { links?: number | null }) => string, items: (score: any) => TaskItemPublic[], shortOf: (score: any) => AnyShort,
 *   learning: boolean, laid: boolean, report: boolean, formats: string[] }} RunView
 */

/** @type {Record<string, Driven | undefined>} */
const DRIVEN = { rigid: "tool", freehand: "tool", snake: "lumen", "snake drive": "lumen" };

/** @type {Record<Driven, RunView>} */
const VIEWS = {
  tool: {
    of: "plan", how: "mode", done: "Path completed",
    facts: (/** @type {ScorePublic} */ score) => factsOf(score),
    certificate: () => "",
    result: () => "",
    short: (/** @type {ShortScore} */ { error_mm: error }) => (error === null ? "" : millimetres(error)),
    brief: (/** @type {ShortScore} */ { time_s: time, error_mm: error, contacts }) => `${fixed(time, 1)} s, ${millimetres(error)}${contacts ? `, ${contacts} contacts` : ""}`,
    robot: () => "",
    items: () => [],
    shortOf: (/** @type {ScorePublic} */ score) => shortOf(score),
    learning: true, laid: true, report: true, formats: ["csv", "about.json", "parquet", "mcap", "py"],
  },
  lumen: {
    of: "route", how: "arm", done: "Drive completed",
    facts: (/** @type {LumenScorePublic} */ score) => lumenFacts(score),
    certificate: (/** @type {LumenScorePublic | ShortLumenScore} */ score) => lumenCertificate(score),
    result: (/** @type {LumenScorePublic} */ score, end = "") => lumenResult(score, end),
    short: (/** @type {ShortLumenScore} */ { depth_mm: depth, deviation_mm: off }) => (depth !== null ? `${fixed(depth, 0)}\u00a0mm` : off === null ? "" : `nearest to a bound ${fixed(off, 1)}\u00a0mm`),
    brief: (/** @type {ShortLumenScore} */ { time_s: time, depth_mm: depth }) => `${duration(time)}${depth === null ? "" : `, ${fixed(depth, 0)} mm`}`,
    robot: ({ links }) => (links ? `${links} link${links === 1 ? "" : "s"}` : ""),
    items: (/** @type {LumenScorePublic} */ { task }) => task?.items ?? [],
    shortOf: (/** @type {LumenScorePublic} */ score) => shortOfLumen(score),
    learning: false, laid: false, report: false, formats: ["csv", "about.json", "parquet"],
  },
};

/** @param {{ world?: string } | null | undefined} run a run, its score or its series @returns {Driven} */
export function drivenOf(run) {
  return DRIVEN[run?.world ?? ""] ?? "tool";
}

/** @param {{ world?: string } | null | undefined} run */
export function viewOf(run) {
  return VIEWS[drivenOf(run)];
}

/**
 * The run as a list has it once its score is known.
 * @template {{ world: string, score: AnyShort | null }} Run
 * @param {Run} run
 * @param {AnyScore} score
 */
export function withScore(run, score) {
  return { ...run, score: run.score ?? viewOf(run).shortOf(score) };
}

/**
 * The result of a run, above its figures.
 * @param {RunView} view
 * @param {ViewModel} state
 * @param {{ plan_id: string | null }} run
 * @param {AnyScore} score
 */
export function resultLine(view, state, { plan_id: route }, score) {
  const words = view.result(score, "depth_mm" in score ? endName(state, route, score) : "");
  return words ? html`<p class="run-result">${words}</p>` : nothing;
}
