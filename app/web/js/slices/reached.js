// How far along its path the tool gets: what is beyond is grey, as in the scene.
import { length, minus, plus } from "./vectors.js";
/** @import { ViewModel } from "../types.js" */
/** @import { Triple } from "./grid.js" */

/**
 * Arc length that the simulation of the stored path reached, mm; null where it is the whole path, or not known.
 * @param {ViewModel} state
 */
export function reachedMm({ corridor }) {
  const verdict = corridor?.state === "current" ? corridor.verdict : null;
  const reach = verdict?.figures.find(({ whole_mm: whole }) => whole !== null); // a structure may have that name
  return verdict && reach?.level === "blocked" ? verdict.profile.s_mm.at(-1) ?? null : null;
}

/**
 * A line in two at an arc length.
 * @param {Triple[]} places
 * @param {number} s mm
 * @returns {[Triple[], Triple[]]}
 */
export function splitAt(places, s) {
  let before = 0;
  for (let at = 1; at < places.length; at += 1) {
    const step = minus(places[at], places[at - 1]);
    const far = length(step);
    if (before + far > s) {
      const middle = plus(places[at - 1], step, Math.max(0, s - before) / far);
      return [[...places.slice(0, at), middle], [middle, ...places.slice(at)]];
    }
    before += far;
  }
  return [places, []];
}
