// Where a structure of a head came from, and how it comes back when it is deleted.

/** @import { StructureEntry } from "/static/js/types.js" */

/**
 * How a structure that is deleted comes back.
 * @param {StructureEntry["origin"]} origin
 * @param {boolean} labelled whether the label that it was painted as is still there
 */
export function wayBack(origin, labelled) {
  if (origin === "ct") return "It was made of this head’s CT by a threshold, and can be made again under ‘Segment’.";
  if (origin !== "painted") return "It came out of a file, which can be imported again.";
  return labelled ? "The label that it was painted as stays, and the surface can be made of it again." : "The label that it was painted as is deleted; restore that first if the structure may be needed again.";
}

/**
 * Whether a structure was made of a painted label, by their ids.
 * @param {string} structure
 * @param {string} label
 */
export function madeOf(structure, label) {
  return structure === `painted-${label.replace(/^label-/, "")}`;
}
