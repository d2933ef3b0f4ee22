// The notes of a plan.
import { h, whenChanged } from "/static/js/dom.js";
import { draw, html, unlessFocused } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { ViewModel } from "/static/js/types.js" */

export class Notes {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.element = h("div", { class: "fields" });
  }

  /** @param {ViewModel} state */
  update({ paths }) {
    const send = (/** @type {Event} */ { currentTarget }) => this.connection.send("plan.notes", { notes: /** @type {HTMLTextAreaElement} */ (currentTarget).value });
    this.changed([paths, Boolean(paths)], () => draw(this.element, html`<textarea id="plan-notes" data-operation="plan.notes" rows="3" maxlength="10000" aria-label="Notes of the plan"
      placeholder="What others should know" ?disabled=${!paths || paths.locked} .value=${unlessFocused(paths?.notes ?? "")} @change=${send}></textarea>`));
  }
}
