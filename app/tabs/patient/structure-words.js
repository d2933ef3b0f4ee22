// Where a structure of a head came from, and how it comes back when it is deleted.

/** @import { StructureEntry } from "/static/js/types.js" */

/**
 * How a structure that is deleted comes back.
 * @param {StructureEntry["origin"]} origin
 * @param {boolean} labelled whether the label that it was painted as is still there
 */
export function wayBack(origin, labelled) {
  if (origin === "ct") return "It can be made again under ‘Threshold’.";
  if (origin !== "painted") return "Its file can be imported again.";
  return labelled ? "Its painted label stays, and can make it again." : "Its painted label is deleted too; restore that first.";
}

/**
 * Whether a structure was made of a painted label, by their ids.
 * @param {string} structure
 * @param {string} label
 */
export function madeOf(structure, label) {
  return structure === `painted-${label.replace(/^label-/, "")}`;
}
