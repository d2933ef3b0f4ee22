// Figures of the control loop and of the path's spline, for who develops: a drawer that only the palette opens.
import { h } from "./dom.js";
import { fixed } from "./format.js";
import { Popover } from "./popover.js";
import { draw, html, iconTool } from "./template.js";
/** @import { DetailsSection, ViewModel } from "./types.js" */

/** @type {[Exclude<keyof DetailsSection, "priority">, string, number, string][]} name, label, digits, unit */
const ROWS = [
  ["loop_hz", "Loop rate", 0, "Hz"], ["step_us", "Step time, median", 0, "µs"], ["step_us_p99", "Step time, 99 %", 0, "µs"],
  ["lateness_us_p50", "Lateness, median", 1, "µs"], ["lateness_us_p99", "Lateness, 99 %", 1, "µs"], ["overruns", "Overruns", 0, ""], ["rows", "Rows in the QP", 0, ""], ["steps", "Steps", 0, ""],
];

export class LoopFigures {
  constructor() {
    this.element = h("aside", { class: "loop-figures", id: "details-sheet", tabIndex: -1, "aria-label": "Figures of the control loop" });
    document.body.append(this.element);
    this.popover = new Popover(this.element);
  }

  show() {
    this.popover.show();
  }

  /** @param {ViewModel} state */
  update({ details, plan, step }) {
    if (!this.popover.isOpen) return;
    const driven = step?.input === "drive" ? details : undefined;
    draw(this.element, html`
      <div class="popover-head"><h2>Control loop</h2>
        ${iconTool("blocked", "Close", () => this.popover.hide(), { title: "Close (Esc)" })}</div>
      <dl class="facts">
        ${ROWS.map(([name, label, digits, unit]) => html`<dt>${label}</dt><dd class="number">${driven ? `${fixed(driven[name], digits)} ${unit}`.trim() : "–"}</dd>`)}
        <dt>Real-time priority</dt><dd>${driven?.priority ?? "–"}</dd>
        <dt>Degree of the spline</dt><dd class="number">${plan?.degree || "–"}</dd>
      </dl>`);
  }
}
