// The figures of suggested ways, named and ordered alike so that they can be compared: those of the verdict of each.

/** @import { AlternativePublic, VerdictFigure } from "/static/js/types.js" */

const LAST = ["in soft tissue", "registration error", "side of the entry", "length"];
export const ARRIVES_MM = 0.5; // a way that ends nearer to the target than this ends at it

/**
 * The figures of the verdict on a way; the length of a path that the tool gets through stands for its reach.
 * @param {AlternativePublic} way
 * @returns {VerdictFigure[]}
 */
export function figuresOf({ figures }) {
  return figures.map((figure) => (figure.whole_mm !== null ? { ...figure, name: "length", value: figure.whole_mm, whole_mm: null } : figure));
}

/**
 * The names of the figures of all ways, in the order in which each way has them: obstacles first.
 * @param {AlternativePublic[]} ways
 */
export function rowsOf(ways) {
  const names = [...new Set(ways.flatMap((way) => figuresOf(way).map(({ name }) => name)))];
  return names.sort((one, other) => LAST.indexOf(one) - LAST.indexOf(other));
}
