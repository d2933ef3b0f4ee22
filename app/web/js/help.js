// The sheet of shortcuts, on ‘?’.
import { show } from "./dialogs.js";
import { barButton, byId, h } from "./dom.js";
import { SHORTCUTS } from "./shortcuts.js";

export class Help {
  /** @param {() => void} again shows the first task once more */
  constructor(again) {
    this.again = again;
    byId("titlebar-tools").append(barButton("help", "Keys", "Keys and first steps (?)", () => this.open(), { id: "help" }));
  }

  async open() {
    const heading = h("h2", { tabIndex: -1 }, "Keys and gestures");
    const form = h("form", { method: "dialog", class: "help-sheet" }, heading,
      h("div", { class: "help-groups" }, SHORTCUTS.map(([title, rows]) => h("section", {}, h("h3", {}, title),
        h("dl", { class: "keys" }, rows.flatMap(({ keys, words }) => [h("dt", {}, keys), h("dd", {}, words)]))))),
      h("div", { class: "buttons" },
        h("button", { type: "submit", value: "again", id: "first-task-again" }, "Show first steps"),
        h("button", { type: "submit", value: "cancel", class: "primary" }, "Close")));
    const answer = await show(form, () => heading.focus()); // else its first button had the focus, far below
    if (answer === "again") this.again();
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
