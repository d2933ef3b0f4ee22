// The tool as the dry run drives it: where its axis lies when the tip is at a place of the path.
/** @import { ViewModel } from "../types.js" */
/** @import { Triple } from "./grid.js" */
/** @import { ToolPose } from "./tool-outline.js" */

/** @typedef {{ s_mm: number[], segments: [Triple, Triple][][], radii_mm: number[], margin_mm: number }} ToolPosesWords as REST tells them */

const NEAR_MM = 1; // a pose that is farther from the wanted place is of another one

/** Says `change`. */
export class ToolPoses extends EventTarget {
  constructor() {
    super();
    /** @type {ToolPosesWords | null} */
    this.words = null;
    this.key = "";
  }

  /**
   * Fetch the poses of a dry run that is done; of any other there are none.
   * @param {ViewModel} state
   */
  async update({ plan, corridor }) {
    const done = plan && corridor?.state === "current";
    const key = done ? JSON.stringify([plan.id, plan.points, plan.tool, corridor.words, corridor.scale?.margin]) : "";
    if (key === this.key) return;
    this.key = key;
    this.show(null);
    if (!plan || !done) return;
    try {
      const response = await fetch(`/api/v1/plans/${encodeURIComponent(plan.id)}/tool-poses`, { credentials: "same-origin" });
      const words = response.ok ? await response.json() : null;
      if (words && key === this.key) this.show(words); // else another plan's
    } catch {
      if (key === this.key) this.key = ""; // the line is down: asked again with the next state
    }
  }

  /** @param {ToolPosesWords | null} words */
  show(words) {
    this.words = words;
    this.dispatchEvent(new Event("change"));
  }

  /**
   * The tool with its tip at an arc length; null where the dry run did not bring it.
   * @param {number} s mm
   * @returns {ToolPose | null}
   */
  at(s) {
    if (!this.words) return null;
    const { s_mm: at, segments, radii_mm: radii, margin_mm: margin } = this.words;
    let best = -1;
    at.forEach((value, index) => { if (best < 0 || Math.abs(value - s) < Math.abs(at[best] - s)) best = index; });
    return best >= 0 && Math.abs(at[best] - s) <= NEAR_MM ? { segments: segments[best], radii, margin } : null;
  }
}
