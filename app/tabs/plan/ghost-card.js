// The question of a click that would not fit where it was: add at the ring, or not. It lies upon the scene.
import { h, whenChanged } from "/static/js/dom.js";
import { line } from "/static/js/said.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { GhostView, ViewModel } from "/static/js/types.js" */

export class GhostCard {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    /** @type {HTMLElement | undefined} what had the focus before */
    this.before = undefined;
    this.element = h("div", { class: "overlay overlay-ghost", id: "ghost-card", hidden: true });
  }

  /** @param {ViewModel} state */
  update({ plan }) {
    this.changed([plan?.ghost], () => this.render(plan?.ghost));
  }

  /** @param {GhostView | null | undefined} ghost */
  render(ghost) {
    const { activeElement } = document;
    const within = this.element.contains(activeElement);
    if (ghost && !within && activeElement instanceof HTMLElement) this.before = activeElement;
    this.element.hidden = !ghost;
    if (!ghost && within) this.before?.focus({ preventScroll: true }); // keys go on where they were, such as in a slice
    if (!ghost) return;
    const send = (/** @type {"ghost.confirm" | "ghost.cancel"} */ type) => () => this.connection.send(type);
    const add = h("button", { type: "button", class: "primary", id: "ghost-add", onclick: send("ghost.confirm"), title: "Enter" }, "Add here");
    this.element.replaceChildren(
      line(ghost.words),
      add,
      h("button", { type: "button", onclick: send("ghost.cancel"), title: "Esc" }, "Cancel"));
    add.focus(/** @type {FocusOptions} */ ({ preventScroll: true, focusVisible: false }));
  }
}
