// The view goes along with the tip of a tool that is driven, where somebody wants that: it looks from the same side.
import { keep, recall } from "../remember.js";

/** @import { Turning } from "./turning.js" */

const LEAST_MM = 0.2; // a tip at rest trembles by less

export class ViewFollower {
  constructor() {
    this.on = recall("follow-view", ["on", "off"], "off") === "on";
    /** @type {number[] | null} of the tip, where the view followed it last; LPS, mm */
    this.followed = null;
  }

  /** @param {boolean} on */
  set(on) {
    this.on = on;
    this.followed = null;
    keep("follow-view", on ? "on" : "off");
  }

  /**
   * @param {number[] | undefined} tip LPS, mm; undefined while none is shown
   * @param {Turning | undefined} turning
   * @param {boolean} pulled whether the pointer pulls something in the scene: it would slip away beneath it
   */
  at(tip, turning, pulled) {
    if (!this.on || !tip || !turning || pulled) {
      this.followed = null;
      return;
    }
    const from = this.followed ?? tip;
    const moved = Math.hypot(...tip.map((value, axis) => value - from[axis]));
    if (this.followed && moved < LEAST_MM) return;
    if (moved) turning.shift(from, tip);
    this.followed = tip;
  }
}
