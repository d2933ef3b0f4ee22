// What a certificate of a pathway does not speak of, in figures beside it: how much of the pathway is behind the wall.
import { fixed } from "./format.js";
import { hintLine } from "./template.js";

const HELP = "The certificate keeps the links in the fitted pathway, not off the wall. So much of the pathway lies behind the wall, and up to so deep where its contours are, in tissue at rest. "
  + "There a certified robot can press into the wall as deep, and by its bound deeper.";

/**
 * '30 % of pathway behind wall, up to 3.5 mm · bound ≤ 8.0 mm'; '' where the wall is not known.
 * @param {{ share: number, depth_mm: number } | null | undefined} behind
 * @param {number | null | undefined} bound mm, the largest of any link
 */
export function behindWords(behind, bound) {
  if (!behind) return "";
  const of = bound === null || bound === undefined ? "" : ` · bound\u00a0≤\u00a0${fixed(bound, 1)}\u00a0mm`;
  return `${fixed(100 * behind.share, 0)}\u00a0% of pathway behind wall, up to ${fixed(behind.depth_mm, 1)}\u00a0mm${of}`;
}

/**
 * The same as a line of a panel, with what it means behind ‘?’.
 * @param {string} id
 * @param {string} words
 */
export function behindLine(id, words) {
  return hintLine(id, words, HELP);
}
