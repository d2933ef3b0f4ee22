// What the endoscope shows: as the tab says, or the air about the path of the open plan in a head's CT.
import { fixed } from "../format.js";

/** @import { ScopeSection, ViewModel } from "../types.js" */

const OF_ANOTHER = "This run is of another plan. Open that plan.";

/**
 * @param {ViewModel} state
 * @param {string | null} [replayed] plan of the run that is replayed, where one is
 * @returns {ScopeSection}
 */
export function scopeOf({ scope, case: head, plan, regions }, replayed) {
  if (scope) return scope;
  const removed = (regions?.items ?? []).filter(({ purpose }) => purpose === "remove").map(({ shape }) => shape);
  const places = [...plan?.points ?? [], ...plan?.targets ?? []].map(({ position }) => position);
  const id = encodeURIComponent(plan?.id ?? "");
  let words = "";
  if (!head || !plan) words = head ? "No plan is open." : "No head is open.";
  else if (!head.has_volume) words = "No CT, so no endoscope. Import this head’s CT in Patient.";
  else if (replayed !== undefined && replayed !== plan.id) words = OF_ANOTHER;
  else if (!plan.points.length) words = "No path yet. Add one in Plan.";
  return {
    surface: `/api/v1/plans/${id}/endoscope`, key: JSON.stringify([plan?.id, places, removed]), look: "nose", hand: false, own: false, pose: null, words,
    poses: plan ? `/api/v1/steps/rehearse/poses?plan=${id}` : "",
  };
}

const NEAR_WALL_MM = 1;

/**
 * What a colonoscopist sees as a red-out, in words; '' away from the wall.
 * @param {number | null | undefined} distance of the lens to the wall, mm, negative behind it
 */
export function wallWords(distance) {
  if (typeof distance !== "number" || distance > NEAR_WALL_MM) return "";
  return distance < 0 ? `Lens ${fixed(-distance, 1)} mm in the wall` : "Lens at the wall";
}
