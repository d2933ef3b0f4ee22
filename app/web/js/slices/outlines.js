// The cuts of the structures' surfaces, which the worker draws into the slices.
/** @import { StateWithSlices } from "../slices.js" */
/** @import { VolumeLink } from "./volume-link.js" */

export class Outlines {
  /** @param {VolumeLink} link */
  constructor(link) {
    this.link = link;
    this.on = true;
    this.asked = ""; // the surfaces that the worker has loaded
  }

  /** Another head is open: none of its surfaces is loaded. */
  forget() {
    this.asked = "";
  }

  /**
   * Have the worker load the surfaces that are drawn; again where structures have come or gone.
   * @param {StateWithSlices | null} state
   */
  ask(state) {
    if (!this.on || !state || !this.link.holds(state.case.id)) return;
    const wanted = state.case.outlines.map(({ surface, colour, closed }) => ({ name: surface, colour, closed }));
    const key = JSON.stringify(wanted);
    if (key === this.asked) return;
    this.asked = key;
    this.link.outline(wanted);
  }
}
