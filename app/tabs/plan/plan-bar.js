// The bar above the steps of a plan: undo, redo, the lock, what a click adds, the plans of this head, and export.
import { h } from "/static/js/dom.js";
import { Roving } from "/static/js/roving.js";
import { draw, html, iconTemplate, iconTool, nothing } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { Commands, PlanSection } from "/static/js/types.js" */

/** @typedef {Commands["add.mode"]["kind"]} Kind */

/** @type {[Kind, string, string][]} */
const KINDS = [["point", "Add point", "To the path"], ["target", "Add target", "To be inspected"], ["none", "Look", "A click adds nothing"]];

export class PlanBar {
  /**
   * @param {Connection} connection
   * @param {() => void} goToExport
   */
  constructor(connection, goToExport) {
    this.connection = connection;
    this.goToExport = goToExport;
    this.element = h("div", { class: "panel-bar", role: "toolbar", "aria-label": "Plan" });
    this.roving = new Roving(this.element, "button", { axis: "horizontal" });
  }

  /** @param {PlanSection | null | undefined} plan */
  update(plan) {
    const { connection } = this;
    const locked = Boolean(plan?.locked);
    draw(this.element, html`<div class="bar-line">
        ${iconTool("undo", "Undo (Ctrl+Z)", () => connection.send("undo"), { id: "undo", operation: "undo", off: !plan?.can_undo })}
        ${iconTool("redo", "Redo (Ctrl+Shift+Z)", () => connection.send("redo"), { id: "redo", operation: "redo", off: !plan?.can_redo })}
        <button type="button" class="plain bar-lock" id="lock" data-operation="lock" aria-pressed=${String(locked)} ?disabled=${!plan} title="Points stay as they are"
          @click=${() => connection.send("lock", { locked: !connection.state.plan?.locked })}>${iconTemplate(locked ? "lock" : "unlock")}${locked ? "Unlock" : "Lock"}</button>
        <span class="bar-space"></span>
        <button type="button" class="plain" id="plans" title="Plans of this head">Plans</button>
        <button type="button" class="plain" id="export" title="Save the plan as a file" ?disabled=${!plan} @click=${this.goToExport}>Export</button>
      </div>
      <div class="bar-line"><span class="bar-label" id="adds-label">Click</span>
        <div class="segmented" role="group" aria-labelledby="adds-label">${KINDS.map(([kind, label, title]) => html`<button type="button" data-kind=${kind} title=${title}
          aria-pressed=${String(kind === plan?.add_mode)} ?disabled=${!plan || locked} @click=${() => connection.send("add.mode", { kind })}>${label}</button>`)}</div>
      </div>${locked ? html`<p class="words">Locked.</p>` : nothing}`);
    this.roving.update();
  }
}
