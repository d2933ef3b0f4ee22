// Runs of the open head as the planner stores them, and the words for what they are worth.
import { fixed, whenShort } from "./format.js";
import { change, download, read } from "./rest.js";

/** @import { LumenScorePublic, LumenSeriesPublic, RunTitle, ScorePublic, SeriesPublic } from "./types.js" */

/** @typedef {ScorePublic | LumenScorePublic} AnyScore */
/** @typedef {SeriesPublic | LumenSeriesPublic} AnySeries */
/** What a list knows of a score. @typedef {NonNullable<RunTitle["score"]>} AnyShort */

/** @type {Record<string, string | undefined>} */
const MODES = { freehand: "Freehand", "hands-on": "Hands-on", teleoperated: "Teleoperated", mixed: "Mixed modes", manual: "Manual", guided: "Guided", certified: "Certified" };
const MOST = 10; // of a learning curve
export const UNCERTIFIED = "without the certificate";

/**
 * Runs that can be scored, newest first.
 * @param {string} caseId
 * @returns {Promise<RunTitle[]>}
 */
export async function runsOf(caseId) {
  /** @type {RunTitle[]} */
  const runs = await read(`/api/v1/cases/${encodeURIComponent(caseId)}/runs`);
  return runs.filter((run) => drivenAs(run) !== null);
}

/**
 * How a run was driven: its control mode, or the arm of a snake's hand; null where nobody knows.
 * @param {{ mode?: string | null, arm?: string | null }} run
 */
export function drivenAs({ mode, arm }) {
  return mode ?? arm ?? null;
}

/** @param {string} id @returns {Promise<AnyScore>} */
export function scoreOf(id) {
  return read(`/api/v1/runs/${encodeURIComponent(id)}/score`);
}

/** @param {string} id @returns {Promise<AnySeries>} */
export function seriesOfRun(id) {
  return read(`/api/v1/runs/${encodeURIComponent(id)}/series`);
}

/**
 * Mark a run as the teacher's, or take the mark away.
 * @param {string} id
 * @param {boolean} on
 * @returns {Promise<RunTitle>}
 */
export function markTeacher(id, on) {
  return change(`/api/v1/runs/${encodeURIComponent(id)}`, { teacher: on });
}

/**
 * The teacher's run of a plan with its score, which is asked for where it is not known; null where there is none.
 * @param {RunTitle[]} runs
 * @param {string | null} plan
 * @returns {Promise<RunTitle | null>}
 */
export async function teacherOf(runs, plan) {
  const found = runs.find(({ plan_id: id, teacher }) => teacher && id === plan);
  return found ? { ...found, score: found.score ?? shortOf(/** @type {ScorePublic} */ (await scoreOf(found.id))) } : null;
}

/**
 * What a list says of a run that was scored since it was read.
 * @param {ScorePublic} score
 */
export function shortOf({ certified, completed, time_s: time, path_error_mm: error, least_clearance_mm: least, contacts, held_s: held }) {
  return {
    certified, completed, contacts, time_s: time, held_s: held, error_mm: error?.robot_frame.mean ?? null, error_max_mm: error?.robot_frame.max ?? null,
    clearance_mm: Math.min(...Object.values(least)),
  };
}

/**
 * Let the browser save the report on runs, the first beside the others; more than six are left out.
 * @param {string[]} ids
 */
export function saveReport([first, ...others]) {
  const beside = others.slice(0, 5).map((id) => `beside=${encodeURIComponent(id)}`).join("&");
  download(`/api/v1/runs/${encodeURIComponent(first)}/report${beside ? `?${beside}` : ""}`);
}

/** @param {string | null | undefined} mode */
export function modeWord(mode) {
  return MODES[mode ?? ""] ?? "Unknown mode";
}

/**
 * Whether a run was driven outside the certificate.
 * @param {Pick<RunTitle, "certified">} run
 */
export function isUncertified({ certified }) {
  return !certified;
}

/**
 * Seconds as people say them: '42.1 s', '2:05 min'.
 * @param {number | null | undefined} seconds
 */
export function duration(seconds) {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return "–";
  if (seconds < 60) return `${fixed(seconds, 1)} s`;
  const whole = Math.round(seconds);
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")} min`;
}

/**
 * A length in mm with as many digits as it deserves: errors of a robot are hundredths.
 * @param {number | null | undefined} value
 */
export function millimetres(value) {
  if (value !== null && value !== undefined && value > 0 && value < 0.0005) return "< 0.001 mm";
  return `${fixed(value, Math.abs(value ?? 1) < 0.1 ? 3 : 2)} mm`;
}

/** @param {RunTitle} run */
export function runName({ recorded }) {
  return whenShort(recorded);
}

/**
 * Mean tip error of a run of a rigid tool in mm; null where it has none.
 * @param {RunTitle | null | undefined} run
 */
export function errorOf(run) {
  const score = run?.score;
  return score && "error_mm" in score ? score.error_mm : null;
}

/**
 * The completed runs of a mode, oldest first, at most the last ten.
 * @param {RunTitle[]} runs newest first
 * @param {string} mode
 */
export function lastOf(runs, mode) {
  return runs.filter((run) => drivenAs(run) === mode && run.score?.completed).slice(0, MOST).reverse();
}

/**
 * The newest completed run of every other mode.
 * @param {RunTitle[]} runs newest first
 * @param {string} mode
 */
export function otherModes(runs, mode) {
  const modes = [...new Set(runs.map((run) => drivenAs(run) ?? ""))].filter((one) => one && one !== mode);
  return modes.flatMap((one) => lastOf(runs, one).slice(-1));
}
