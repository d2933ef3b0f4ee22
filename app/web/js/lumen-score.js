// The score of a run of a snake robot in a lumen, as rows.
import { behindWords } from "./behind-wall.js";
import { fixed, sentence } from "./format.js";
import { duration } from "./runs.js";

/** @import { Fact } from "./run-score.js" */
/** @import { LumenScorePublic, ViewModel } from "./types.js" */

const PERCENT = 100;
const END_MM = 2; // a robot that comes so near to the end of its way comes to it
const DECIDE = ["Time driven", "Depth", "Deviation, largest", "Beyond bound", "Behind wall, links", "Hand force, largest"];
const DECIDE_TASK = ["Time driven", "Depth", "Distance error", "Angle error", "Distance from the arrow", "Beyond bound", "Behind wall, links"];

/**
 * The result in one line: what the task came to, and where the tip did.
 * @param {LumenScorePublic} score
 * @param {string} [end] name of the end of the way; '' where it has none
 */
export function lumenResult({ completed, depth_mm: depth, length_mm: length, reach_mm: reach, task }, end = "") {
  const parts = task?.result ? [task.result] : [];
  const short = length !== null && reach !== null && reach < length - END_MM;
  const place = end ? `the ${end.charAt(0).toLowerCase()}${end.slice(1)}` : "the end";
  if (depth !== null && completed && short) parts.push(`came as deep as this robot can, ${fixed(depth, 0)} of ${fixed(length, 0)} mm`);
  else if (depth !== null && completed) parts.push(`reached ${place}, ${fixed(depth, 0)} mm`);
  else if (depth !== null) parts.push(task?.result ? "end not reached" : `came ${fixed(depth, 0)} of ${fixed(length, 0)} mm`);
  return sentence(parts.join(" · "));
}

/**
 * What stands beside the arm of a run that was certified.
 * @param {Pick<LumenScorePublic, "certified" | "behind_wall" | "bound_mm">} score
 */
export function lumenCertificate({ certified, behind_wall: behind, bound_mm: bound }) {
  return certified ? behindWords(behind, bound) : "";
}

/**
 * The landmark at the end of the way of a run, by the route that is open and was not changed since; '' for none.
 * @param {Pick<ViewModel, "route" | "route_path" | "case">} state
 * @param {string | null} routeId of the one that was driven
 * @param {LumenScorePublic} score
 */
export function endName({ route, route_path: path, case: open }, routeId, { length_mm: length }) {
  const at = route?.end;
  if (!at || route.id !== routeId || length === null || Math.abs((path?.length_mm ?? NaN) - length) > 1) return "";
  return open?.landmarks.find(({ position }) => position.every((value, axis) => Math.abs(value - at[axis]) < 0.01))?.name ?? "";
}

/**
 * What is worth saying of a run, in the order in which it is read; last what its task adds.
 * @param {LumenScorePublic} score
 * @returns {Fact[]}
 */
export function lumenFacts(score) {
  const { deviation, nearest_mm: nearest, bound_mm: bound, beyond_bound_mm: beyond, behind_wall: behind, force_n: force, withdrawal_s: back, task } = score;
  /** @type {Fact[]} */
  const facts = [
    { name: "Time driven", value: duration(score.time_s) },
  ];
  if (score.depth_mm !== null && score.share !== null && score.insertion_s !== null) { // from a fixed base nothing is inserted
    facts.push(
      { name: "Depth", value: `${fixed(score.depth_mm, 0)} mm` },
      { name: "Share of the route", value: `${fixed(PERCENT * score.share, 0)} %` },
      { name: "Time in", value: duration(score.insertion_s) },
      { name: "Withdrawal", value: back === null ? "not drawn out" : duration(back) },
    );
  }
  if (deviation) facts.push({ name: "Deviations", value: `${deviation.episodes}, ${duration(deviation.time_s)}` }, { name: "Deviation, largest", value: `${fixed(deviation.depth_mm?.max ?? 0, 1)} mm` });
  if (nearest) facts.push({ name: "Nearest to a bound", value: `${fixed(nearest.max, 1)} mm` });
  facts.push(
    ...(bound === null ? [] : [{ name: "Bound, largest", value: `${fixed(bound, 1)} mm` }]),
    { name: "Beyond bound", value: `${fixed(beyond, beyond > 0 ? 1 : 0)} mm`, worse: beyond > 0 },
    ...(behind ? [{ name: "Behind wall, links", value: behind.links_mm === null ? "not measured" : `${fixed(behind.links_mm, 1)} mm` },
      { name: "Behind wall, pathway", value: `${fixed(PERCENT * behind.share, 0)} %, ${fixed(behind.depth_mm, 1)} mm` }] : []),
    { name: "Path of the tip", value: `${fixed(score.path_length_mm, 0)} mm` },
    { name: "Hand force, mean", value: `${fixed(force.mean, 2)} N` },
    { name: "Hand force, largest", value: `${fixed(force.max, 1)} N` },
    { name: "Held", value: duration(score.held_s) },
  );
  for (const { name, value, unit, digits, worse } of task?.rows ?? []) facts.push({ name, value: `${fixed(value, digits)}${unit && value !== null ? ` ${unit}` : ""}`, worse });
  if (task?.lacking) facts.push({ name: task.title, value: task.lacking });
  const decide = task ? DECIDE_TASK : DECIDE;
  return facts.map((fact) => ({ ...fact, folded: !decide.includes(fact.name) }));
}

/** @param {LumenScorePublic} score what a list says of it */
export function shortOfLumen({ certified, completed, time_s, depth_mm, nearest_mm: nearest, beyond_bound_mm, bound_mm, behind_wall, held_s, task }) {
  return { certified, completed, time_s, depth_mm, deviation_mm: nearest?.max ?? null, beyond_bound_mm, bound_mm, behind_wall, held_s, task: task?.title ?? null };
}
