// The sheet of shortcuts, on ‘?’.
import { show } from "./dialogs.js";
import { barButton, byId, h } from "./dom.js";
import { shortcutsIn } from "./shortcuts.js";

const SCROLL_PX = 60; // of an arrow key

export class Help {
  /**
   * @param {() => void} again shows the first task once more
   * @param {() => string | undefined} tab label of the one that is shown, whose keys come first
   */
  constructor(again, tab) {
    this.again = again;
    this.tab = tab;
    byId("titlebar-tools").append(barButton("help", "Keys", "Keys and first steps (?)", () => this.open(), { id: "help" }));
  }

  async open() {
    const groups = h("div", { class: "help-groups" });
    const none = h("p", { class: "empty", hidden: true }, "No key has that name.");
    /** @type {HTMLInputElement} */
    const filter = h("input", { type: "text", id: "keys-filter", "aria-label": "Filter keys", placeholder: "Filter keys", autocomplete: "off", spellcheck: false });
    const list = () => {
      const found = sectionsOf(filter.value, this.tab());
      groups.replaceChildren(...found);
      none.hidden = found.length > 0;
    };
    filter.addEventListener("input", list);
    filter.addEventListener("keydown", (event) => scrolled(event, form));
    list();
    const form = h("form", { method: "dialog", class: "help-sheet" }, h("h2", {}, "Keys and gestures"), filter, groups, none,
      h("div", { class: "buttons" },
        h("button", { type: "submit", value: "again", id: "first-task-again" }, "Show first steps"),
        h("button", { type: "submit", value: "cancel", class: "primary" }, "Close")));
    const answer = await show(form, () => filter.focus()); // else its first button had the focus, far below
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

/**
 * The groups with the rows that hold every word that is typed; the keys of the tab come first.
 * @param {string} typed
 * @param {string} [tab]
 */
function sectionsOf(typed, tab) {
  const words = typed.toLocaleLowerCase().split(/\s+/u);
  return shortcutsIn(tab).flatMap(([title, rows]) => {
    const found = rows.filter((row) => words.every((word) => `${title} ${row.keys} ${row.words}`.toLocaleLowerCase().includes(word)));
    return found.length ? [h("section", {}, h("h3", {}, title), h("dl", { class: "keys" }, found.flatMap((row) => [h("dt", {}, row.keys), h("dd", {}, row.words)])))] : [];
  });
}

/**
 * While the filter has the focus, ↑ and ↓ scroll the sheet; Enter chooses nothing.
 * @param {KeyboardEvent} event
 * @param {HTMLElement} form in the dialog that scrolls
 */
function scrolled(event, form) {
  const by = { ArrowUp: -SCROLL_PX, ArrowDown: SCROLL_PX }[event.key];
  if (by) form.parentElement?.scrollBy(0, by);
  else if (event.key !== "Enter") return;
  event.preventDefault();
}
