// The target with which ‘Inspect’ begins if none was chosen.

/** @import { ConeSection, ItemEntry } from "/static/js/types.js" */

/**
 * The id of the target that is nearest to a place, of those that the tool can see from some direction; of all of them
 * where none can be seen, or nothing is known of that. Null without targets.
 * @param {ItemEntry[]} targets
 * @param {ConeSection | undefined} cones of the targets
 * @param {number[] | null} place of the view point now, or of the end of the path; LPS mm
 */
export function preselected(targets, cones, place) {
  const blind = new Set(cones?.state === "current" ? cones.items.filter((cone) => cone.cone_deg === 0).map((cone) => cone.target) : []);
  const seen = targets.filter(({ id }) => !blind.has(id));
  const among = seen.length ? seen : targets;
  if (!place || !among.length) return among[0]?.id ?? null;
  const away = (/** @type {ItemEntry} */ { position }) => Math.hypot(...position.map((x, axis) => x - place[axis]));
  return among.reduce((best, one) => (away(one) < away(best) ? one : best)).id;
}
