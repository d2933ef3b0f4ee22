// The order of what a tool is near to: calm, so that nothing jumps to and fro.

/** @import { NearnessView } from "./types.js" */

const CALM_MM = 0.3; // two that differ less do not change their places

/**
 * The least above its margin first; those that are about as near stay in the order in which they are shown.
 * @param {NearnessView[]} structures
 * @param {string[]} order names, as they were shown
 */
export function worstFirst(structures, order) {
  const left = (/** @type {NearnessView} */ { clearance_mm: clearance, margin_mm: margin }) => clearance - margin;
  const shown = [...structures].sort((a, b) => placeIn(order, a.name) - placeIn(order, b.name));
  // of neighbours, so that nothing jumps for less than the calm distance
  for (let end = shown.length; end > 1; end--) {
    for (let at = 0; at + 1 < end; at++) {
      if (left(shown[at]) > left(shown[at + 1]) + (order.length ? CALM_MM : 0)) [shown[at], shown[at + 1]] = [shown[at + 1], shown[at]];
    }
  }
  return shown;
}

/**
 * @param {string[]} order
 * @param {string} name
 */
function placeIn(order, name) {
  const at = order.indexOf(name);
  return at < 0 ? order.length : at;
}
