// The bar above the steps of a registration: undo, redo, the lock, and its name, which leads to the others of this head.
import { h } from "/static/js/dom.js";
import { Roving } from "/static/js/roving.js";
import { draw, html, iconTemplate, iconTool, nothing } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { RegistrationSection } from "/static/js/types.js" */

export class RegistrationBar {
  /**
   * @param {Connection} connection
   * @param {() => void} goToList
   */
  constructor(connection, goToList) {
    this.connection = connection;
    this.goToList = goToList;
    this.element = h("div", { class: "panel-bar", role: "toolbar", "aria-label": "Registration" });
    this.roving = new Roving(this.element, "button", { axis: "horizontal" });
  }

  /** @param {RegistrationSection | null | undefined} registration */
  update(registration) {
    const { connection } = this;
    const locked = Boolean(registration?.locked);
    this.element.hidden = !registration;
    draw(this.element, html`<div class="bar-line">
        ${iconTool("undo", "Undo (Ctrl+Z)", () => connection.send("registration.undo"), { id: "registration-undo", operation: "registration.undo", off: !registration?.can_undo })}
        ${iconTool("redo", "Redo (Ctrl+Shift+Z)", () => connection.send("registration.redo"), { id: "registration-redo", operation: "registration.redo", off: !registration?.can_redo })}
        <button type="button" class="plain bar-lock" id="registration-lock" data-operation="registration.lock" aria-pressed=${String(locked)} ?disabled=${!registration} title="It stays as it is"
          @click=${() => connection.send("registration.lock", { locked: !connection.state.registration?.locked })}>${iconTemplate(locked ? "lock" : "unlock")}${locked ? "Unlock" : "Lock"}</button>
        <span class="bar-space"></span>
        <button type="button" class="plain bar-name" id="registration-words" title="Registrations of this head" @click=${this.goToList}><span>${registration?.name}</span></button>
      </div>${registration?.calibration.to === "base" ? html`<p class="words" id="registered-to-base">To the robot's base.</p>` : nothing}`);
    this.roving.update();
  }
}
