// What runs of a snake robot in a lumen are compared by; last what their task adds.

/** @import { LumenScorePublic } from "/static/js/types.js" */
/** @import { Figure } from "./compare.js" */

const PERCENT = 100;

/** @type {Figure<LumenScorePublic>[]} */
const FIGURES = [
  { name: "Time driven", unit: "s", digits: 1, of: ({ time_s: time }) => time },
  { name: "Depth", unit: "mm", digits: 0, of: ({ depth_mm: depth }) => depth, more: true },
  { name: "Share of the route", unit: "%", digits: 0, of: ({ share }) => (share === null ? null : PERCENT * share), more: true },
  { name: "Time in", unit: "s", digits: 1, of: ({ insertion_s: time }) => time },
  { name: "Withdrawal", unit: "s", digits: 1, of: ({ withdrawal_s: time }) => time, neutral: true },
  { name: "Deviations", unit: "", digits: 0, of: ({ deviation }) => deviation?.episodes ?? null },
  { name: "Deviation, time", unit: "s", digits: 1, of: ({ deviation }) => deviation?.time_s ?? null },
  { name: "Deviation, mean", unit: "mm", digits: 1, of: ({ deviation }) => deviation?.depth_mm?.mean ?? null },
  { name: "Deviation, largest", unit: "mm", digits: 1, of: ({ deviation }) => deviation?.depth_mm?.max ?? null },
  { name: "Nearest to a bound", unit: "mm", digits: 1, of: ({ nearest_mm: nearest }) => nearest?.max ?? null },
  { name: "Bound, largest", unit: "mm", digits: 1, of: ({ bound_mm: bound }) => bound, neutral: true },
  { name: "Beyond bound", unit: "mm", digits: 1, of: ({ beyond_bound_mm: beyond }) => beyond },
  { name: "Behind wall, links", unit: "mm", digits: 1, of: ({ behind_wall: behind }) => behind?.links_mm ?? null },
  { name: "Behind wall, pathway", unit: "%", digits: 0, of: ({ behind_wall: behind }) => (behind ? PERCENT * behind.share : null), neutral: true },
  { name: "Path of the tip", unit: "mm", digits: 0, of: ({ path_length_mm: length }) => length },
  { name: "Hand force, mean", unit: "N", digits: 2, of: ({ force_n: { mean } }) => mean },
  { name: "Hand force, largest", unit: "N", digits: 1, of: ({ force_n: { max } }) => max },
  { name: "Held", unit: "s", digits: 1, of: ({ held_s: held }) => held },
];

/** @param {LumenScorePublic[]} scores @returns {Figure<LumenScorePublic>[]} */
export function lumenFigures(scores) {
  const rows = new Map(scores.flatMap(({ task }) => task?.rows ?? []).map((row) => [row.name, row]));
  return [...FIGURES, ...[...rows.values()].map(({ name, unit, digits }) => ({ name, unit, digits, of: (/** @type {LumenScorePublic} */ { task }) => task?.rows.find((row) => row.name === name)?.value ?? null }))];
}
