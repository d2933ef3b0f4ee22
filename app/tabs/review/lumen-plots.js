// What is plotted of a run of a snake robot in a lumen, over time.
import { fixed } from "/static/js/format.js";
import { overTime } from "./curves.js";
import { bothRuns } from "./run-lines.js";

/** @import { LumenSeriesPublic } from "/static/js/types.js" */
/** @import { Content } from "./plots.js" */

/** Why a command was held, by the limit's name; a link is named where its bound is the limit. @type {Record<string, string | undefined>} */
const HELD = {
  bound: "a link at its bound", speed: "joints at full speed", step: "the largest step", bends: "no such bend", bent: "the tip is bent", range: "a joint’s range",
  end: "the end of the way", tissue: "moving tissue", insertion: "insertion comes first", planning: "planning",
};

/**
 * Without those in which neither run has anything but zeros, by the digits that are shown: from a fixed base nothing is inserted.
 * @param {LumenSeriesPublic} main
 * @param {LumenSeriesPublic | null} ghost
 * @returns {Content[]}
 */
export function lumenContents(main, ghost) {
  const runs = ghost ? [main, ghost] : [main], lines = () => bothRuns(main, ghost);
  const bound = overTime(runs, (series) => series.deviation_mm), own = overTime(runs, (series) => (series === main ? series.bound_mm : []));
  const force = overTime(runs, (series) => series.force_n), guidance = overTime(runs, (series) => (series === main ? series.guidance_n : []));
  /** @type {Content[]} */
  const all = [
    { title: "Depth", unit: "mm", lines: lines(), curves: overTime(runs, (series) => series.depth_mm), digits: 0, now: (at) => heldWords(main, at) || `${fixed(main.depth_mm[at], 0)} mm` },
    {
      title: "Nearest to a bound", unit: "mm", digits: 1, lines: [...lines(), { name: "bound", colour: "--caution", width: 1.25, dash: [2, 3] }],
      curves: { x: bound.x, lines: [...bound.lines, own.lines[0]] },
      now: (at) => (main.link[at] ? `${fixed(main.deviation_mm[at], 1)} of ${fixed(main.bound_mm[at], 1)} mm, link ${main.link[at]}` : "no link inside"),
    },
    { title: "Bend r", unit: "", lines: lines(), curves: overTime(runs, (series) => series.bend), digits: 1, now: (at) => fixed(main.bend[at], 2) },
    {
      title: "Force on the hand", unit: "N", digits: 1, lines: [...lines(), { name: "guidance", colour: "--caution", width: 1.25 }],
      curves: { x: force.x, lines: [...force.lines, guidance.lines[0]] }, now: (at) => `${fixed(main.force_n[at], 2)} N`,
    },
    { title: "Insertion", unit: "mm/s", lines: lines(), curves: overTime(runs, (series) => series.speed_mm_per_s), digits: 0, signed: true, now: (at) => `${fixed(main.speed_mm_per_s[at], 1)} mm/s` },
  ];
  return all.filter(({ curves, digits }) => curves.lines.some((line) => line.some((value) => Math.abs(value ?? 0) >= 0.5 * 10 ** -digits)));
}

/**
 * What held the robot at a sample; '' where nothing did.
 * @param {LumenSeriesPublic} series
 * @param {number} at
 */
export function heldWords({ held, limit, limit_link: link, limits }, at) {
  if (!held[at]) return "";
  return `held: ${link[at] ? `link ${link[at]} at its bound` : HELD[limits[limit[at]]] ?? "reason not known"}`;
}
