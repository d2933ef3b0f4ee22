// How the view is moved: zoom goes to the pointer, the view turns about what was clicked, and stays as it is at a click.

/** @import { SceneHooks } from "./hooks.js" */

export class Turning {
  /** @param {SceneHooks} hooks */
  constructor(hooks) {
    this.hooks = hooks;
    hooks.controls.dollyToCursor = true;
    const { smoothTime } = hooks.controls;
    const still = matchMedia("(prefers-reduced-motion: reduce)");
    const obey = () => { hooks.controls.smoothTime = still.matches ? 0 : smoothTime; }; // else it glides to a halt
    still.addEventListener("change", obey);
    obey();
    /** @type {number[] | null} LPS, mm */
    this.pivot = null;
  }

  /**
   * Turn about a place; null is the middle of the view, as after a standard view.
   * @param {number[] | null} pivot LPS, mm
   */
  about(pivot) {
    if (String(pivot) === String(this.pivot)) return;
    this.pivot = pivot;
    if (!pivot) return;
    const { x, y, z } = this.hooks.world(pivot);
    this.hooks.controls.setOrbitPoint(x, y, z);
    this.hooks.redraw();
  }

  /** Bring the clicked place to the middle of the view; it is looked at from the same side. */
  centre() {
    if (!this.pivot) return false;
    const { x, y, z } = this.hooks.world(this.pivot);
    this.hooks.controls.setFocalOffset(0, 0, 0, false);
    this.hooks.controls.moveTo(x, y, z, false);
    this.hooks.redraw();
    return true;
  }

  /**
   * Go along with a place that has moved.
   * @param {number[]} from LPS, mm
   * @param {number[]} to
   */
  shift(from, to) {
    const { hooks } = this;
    const way = hooks.world(to).sub(hooks.world(from));
    const { x, y, z } = hooks.controls.getTarget(way.clone()).add(way);
    hooks.controls.moveTo(x, y, z, false);
    hooks.redraw();
  }

  /** Before a standard view: what was shifted aside for a pivot is taken back, or the view would come out beside it. */
  reset() {
    this.pivot = null;
    this.hooks.controls.setFocalOffset(0, 0, 0, false);
  }
}
