// The sheet of shortcuts, on ‘?’.
import { show } from "./dialogs.js";
import { byId, h, icon } from "./dom.js";
import { SHORTCUTS } from "./shortcuts.js";

export class Help {
  /** @param {() => void} again shows the first task once more */
  constructor(again) {
    this.again = again;
    const button = h("button", { type: "button", class: "icon plain", id: "help", title: "Keys and first steps (?)", "aria-label": "Keys and first steps", onclick: () => this.open() }, icon("help"));
    byId("titlebar-tools").append(button);
  }

  async open() {
    const form = h("form", { method: "dialog", class: "help-sheet" }, h("h2", {}, "Keys and gestures"),
      h("div", { class: "help-groups" }, SHORTCUTS.map(([title, rows]) => h("section", {}, h("h3", {}, title),
        h("dl", { class: "keys" }, rows.flatMap(({ keys, words }) => [h("dt", {}, keys), h("dd", {}, words)]))))),
      h("div", { class: "buttons" },
        h("button", { type: "submit", value: "again", id: "first-task-again" }, "Show first steps"),
        h("button", { type: "submit", value: "cancel", class: "primary" }, "Close")));
    if ((await show(form)) === "again") this.again();
  }

  /**
   * Whether the key asks for help.
   * @param {KeyboardEvent} event
   */
  key(event) {
    if (event.key !== "?" || event.ctrlKey || event.metaKey || event.altKey) return false;
    this.open();
    return true;
  }
}
