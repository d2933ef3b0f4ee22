// What the status bar says of the tool: that a free hand has no certificate, force, tip error, clearance, target, and what holds it.
import { UNCERTIFIED } from "/static/js/runs.js";
import { holdingWords, reading } from "/static/js/status.js";
import { isFree } from "./modes.js";

/** @import { RehearsalSection, ViewModel } from "/static/js/types.js" */

const NEAR_MM = 0.1; // this close to the margin the clearance is shown as a caution

export class RehearsalStatus {
  constructor() {
    this.mode = reading("Freehand");
    this.mode.say(UNCERTIFIED);
    this.mode.element.classList.add("alarm");
    this.force = reading("Force");
    this.tip = reading("Tip error");
    this.clearance = reading("To bone");
    this.target = reading("To the target");
    this.holding = reading("Held by", "fill");
    this.elements = [this.mode, this.force, this.tip, this.clearance, this.target, this.holding].map(({ element }) => element);
  }

  /** @param {ViewModel} state */
  update({ rehearsal }) {
    /** @type {Partial<RehearsalSection>} */
    const now = rehearsal ?? {};
    this.mode.element.hidden = !isFree(now);
    this.force.set(now.force_n, 2, "N");
    this.tip.set(now.mode === "path" ? now.tip_error_mm : null, 1, "mm");
    this.clearance.set(now.clearance_mm, 2, "mm", now.clearance_capped ? "≥ " : "");
    const slack = (now.clearance_mm ?? NaN) - (now.margin_mm ?? NaN);
    this.clearance.element.classList.toggle("caution", slack < NEAR_MM);
    this.target.element.hidden = now.mode !== "inspect";
    this.target.set(now.target_error_mm, 1, "mm");
    this.holding.say(holdingWords(now, "In place at the entry, not started"));
    this.holding.element.classList.toggle("caution", Boolean(now.held));
  }
}
