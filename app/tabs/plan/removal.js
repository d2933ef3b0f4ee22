// The ball of bone removal that is begun where a way ends.

/** @typedef {[number, number, number]} Triple */

const LEAST_MM = 4;
const SPARE_MM = 1; // beyond tool and margin
const THIN_MM = 8; // of bone between the end of a way and the target, which one ball opens

/**
 * A ball that the tool passes: about the end of the way, or from there to the target where that is near.
 * @param {Triple} end of the way, LPS mm
 * @param {Triple} target
 * @param {number} tool radius of its shaft, mm
 * @param {number} margin mm
 * @returns {{ position: Triple, radius: number }} mm
 */
export function removalBall(end, target, tool, margin) {
  const passes = tool + margin + SPARE_MM;
  const gap = Math.hypot(...end.map((value, axis) => target[axis] - value));
  const joins = gap <= THIN_MM;
  const position = joins ? /** @type {Triple} */ (end.map((value, axis) => (value + target[axis]) / 2)) : end;
  const radius = Math.max(LEAST_MM, joins ? gap / 2 + passes : passes);
  return { position, radius: Math.ceil(10 * radius) / 10 };
}
