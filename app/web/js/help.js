// The sheet of shortcuts, on ‘?’.
import { show } from "./dialogs.js";
import { byId, h, icon } from "./dom.js";

/** @type {[string, [string, string][]][]} groups of keys and what they do */
export const SHORTCUTS = [
  ["Views", [
    ["1, 2, 3", "Axial, coronal or sagittal slice alone; again: back"],
    ["4, 5", "Scene, or the view across the path, alone; again: back"],
    ["P", "Fold the panel away, and back"],
    ["C", "Bring the clicked place to the middle of the scene"],
    ["Drag, wheel", "Turn the scene about the clicked place; zoom to the pointer"],
    ["Right drag", "Move the scene sideways"],
  ]],
  ["Slices", [
    ["Wheel, Page ↑ ↓", "Move through the head"],
    ["Ctrl + wheel", "Zoom to the pointer"],
    ["Right drag", "Window (sideways) and level (up and down)"],
    ["Ctrl + drag", "Move the picture"],
    ["↑ ↓ ← →", "Move the crosshair by 1 mm; Shift 5, Alt 0.1"],
    ["Enter", "Add at the crosshair"],
    ["Space", "While drawing: a place at the crosshair"],
    ["M", "Lift the chosen point; arrows carry it, Enter drops it, Esc returns it"],
    ["Double-click", "This slice alone, and back"],
  ]],
  ["Plan", [
    ["Click", "Add what is chosen under ‘A click adds’"],
    ["Enter, Esc", "Add at the ring, or take it back"],
    ["Ctrl Z, Ctrl Shift Z", "Undo, redo"],
    ["F2", "Rename what is selected"],
    ["Del", "Delete what is selected"],
  ]],
  ["Register", [
    ["Click", "In the scene: bring the slices to the clicked place"],
    ["Ctrl Z, Ctrl Shift Z", "Undo, redo of the registration"],
  ]],
  ["Rehearse", [
    ["↑ ↓ or W S", "Hold: drive forward or back along the path, whatever was clicked last; in a list W S"],
    ["A D", "Hold: twist the tool, in Free and Inspect"],
    ["Drag the sphere", "Pull the tool by hand"],
  ]],
];

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
        h("dl", { class: "keys" }, rows.flatMap(([keys, words]) => [h("dt", {}, keys), h("dd", {}, words)]))))),
      h("div", { class: "buttons" },
        h("button", { type: "submit", value: "again", id: "first-task-again" }, "Show the first steps again"),
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
