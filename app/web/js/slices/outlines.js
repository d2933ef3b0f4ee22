// The cuts of the structures' surfaces, which the worker draws into the slices.
/** @import { StateWithSlices } from "../slices.js" */
/** @import { VolumeLink } from "./volume-link.js" */

const TRY_AGAIN_MS = 5000;

export class Outlines {
  /** @param {VolumeLink} link */
  constructor(link) {
    this.link = link;
    this.on = true;
    this.asked = ""; // the surfaces that the worker has loaded, and for which opening of the link
    link.addEventListener("unoutlined", () => setTimeout(() => this.forget(), TRY_AGAIN_MS));
  }

  /** None of the surfaces is loaded: another head is open, or they did not come. */
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
    const key = JSON.stringify([this.link.head, wanted]);
    if (key === this.asked) return;
    this.asked = key;
    this.link.outline(wanted);
  }
}
