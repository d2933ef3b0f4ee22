// From where on a figure of the robot is amber, in the panel and in the status bar.

/** @import { SnakeView } from "/static/js/types.js" */

const NEAR_SHARE = 0.9; // of a link's bound, by which the tissue is taken to yield: behind the wall too

export const LIMIT_WORDS = "Amber from 90 % of the link’s bound on.";

/**
 * Whether a figure of a link is near its bound, or beyond it.
 * @param {number} mm
 * @param {number | null} bound_mm null where the link has none
 */
function isNear(mm, bound_mm) {
  return bound_mm !== null && mm > NEAR_SHARE * bound_mm;
}

/** @param {Pick<SnakeView, "nearest" | "deepest"> | null | undefined} snake */
export function cautions(snake) {
  const { nearest, deepest } = snake ?? {};
  return {
    deviation: Boolean(nearest && isNear(nearest.deviation_mm, nearest.bound_mm)),
    behind: Boolean(deepest && isNear(deepest.depth_mm, deepest.bound_mm)),
  };
}
