// The lines of a run and of the one beside it in a plot.
import { UNCERTIFIED, drivenAs, modeWord } from "/static/js/runs.js";

/** @import { Line } from "/static/js/plot-line.js" */
/** @import { AnySeries } from "/static/js/runs.js" */

export const GHOST = { colour: "--ghost", width: 1.25, dash: [5, 4] };

/**
 * The key of a run's line: how it was driven, and that it had no certificate (HAZ-41).
 * @param {AnySeries} series
 * @param {string} [place]
 */
export function keyOfRun(series, place = "") {
  return { name: `${place}${modeWord(drivenAs(series))}`, ...(series.certified ? {} : { caution: UNCERTIFIED }) };
}

/**
 * The line of a run, and that of the one beside it.
 * @param {AnySeries} main
 * @param {AnySeries | null} ghost
 * @returns {Line[]}
 */
export function bothRuns(main, ghost) {
  return [{ ...keyOfRun(main), colour: "--accent" }, ...(ghost ? [{ ...keyOfRun(ghost, "Beside: "), ...GHOST }] : [])];
}
