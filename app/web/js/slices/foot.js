// What stands below the slices: what the mouse does, grey values, zoom, a place to go to.
import { note } from "../dialogs.js";
import { h } from "../dom.js";
import { OWN, PRESETS, SCANNER } from "./grey-values.js";
import { keep, recall } from "../remember.js";
import { placeOf, placeWords } from "./place-words.js";
/** @import { Slices, Tool } from "../slices.js" */

/** @type {[Tool, string, string][]} name, label, what it is for */
const TOOLS = [
  ["cross", "Point", "A click adds what is chosen in the panel, or moves the crosshair"],
  ["window", "Window", "A drag sets the window (sideways) and the level (up and down)"],
  ["distance", "Distance", "Two clicks measure a distance"],
  ["angle", "Angle", "Three clicks measure an angle, the second at its corner"],
];
const HINT = "Wheel: slice. Ctrl+wheel: zoom. Right button or Shift+drag: window and level. Middle button or Ctrl+drag: pan. Double-click: large.";

export class Foot {
  /** @param {Slices} board */
  constructor(board) {
    this.board = board;
    /** @type {HTMLInputElement} */
    this.zoomInput = h("input", { type: "range", min: 1, max: 12, step: 0.25, value: 2, "aria-label": "Zoom of the slices", oninput: () => board.zoomAll(Number(this.zoomInput.value)) });
    this.zoomWords = h("span", { class: "number" }, "2.0×");
    this.window = h("select", { "aria-label": "Grey values", onchange: () => this.chosen() },
      PRESETS.map(({ name, label }) => h("option", { value: name }, label)), h("option", { value: SCANNER, hidden: true }, "As the scanner suggests"), h("option", { value: OWN, hidden: true }, "Own"));
    this.greyWords = h("span", { class: "number quiet" });
    this.follow = h("input", { type: "checkbox", id: "follow-tip", checked: recall("follow-tip", ["on", "off"], "on") === "on", onchange: () => this.followed() });
    this.followField = h("label", { class: "check" }, this.follow, "Follow the tip");
    /** @type {HTMLInputElement} */
    this.outlines = h("input", { type: "checkbox", id: "slice-outlines", checked: true, onchange: () => board.outline(this.outlines.checked) });
    this.outlinesField = h("label", { class: "check" }, this.outlines, "Outlines of surfaces");
    this.tools = TOOLS.map(([name, label, title]) => h("button", { type: "button", title, "data-tool": name, onclick: () => board.choose(name) }, label));
    /** @type {HTMLButtonElement} */
    this.clear = h("button", { type: "button", class: "plain", onclick: () => board.measures.clear() }, "Clear measures");
    this.place = h("input", { type: "text", id: "slice-place", placeholder: "R 24.5 A 10 S 3", autocomplete: "off", "aria-label": "Go to a place: R or L, A or P, S or I, in mm", onkeydown: (event) => this.typed(event) });
    this.hint = h("p", { class: "slices-hint quiet" }, HINT);
    this.said = h("p", { class: "slices-said", role: "status" });
    this.element = h("div", { class: "slices-foot" },
      h("div", { class: "segmented", role: "group", "aria-label": "What the mouse does in the slices" }, this.tools), this.clear, this.said, this.followField,
      h("label", { class: "field" }, h("span", { class: "field-label" }, "Grey values", this.greyWords), this.window),
      h("label", { class: "field" }, h("span", { class: "field-label" }, "Zoom", this.zoomWords), this.zoomInput),
      h("div", { class: "slices-go" }, this.place, h("button", { type: "button", onclick: () => this.go() }, "Go")),
      this.outlinesField, board.second.element, this.hint);
    board.greys.addEventListener("change", () => this.update());
    board.measures.addEventListener("change", () => this.update());
    this.update();
  }

  followed() {
    keep("follow-tip", this.follow.checked ? "on" : "off");
    this.board.followAgain();
  }

  update() {
    const { greys, measures, tool } = this.board;
    const suggested = Boolean(this.board.state?.case.window);
    for (const option of this.window.options) if (option.value === SCANNER) option.hidden = option.disabled = !suggested;
    const known = PRESETS.some(({ name }) => name === greys.name) || (suggested && greys.name === SCANNER);
    this.window.value = known ? greys.name : OWN;
    this.greyWords.textContent = `${Math.round(greys.window)} / ${String(Math.round(greys.level)).replace("-", "−")} HU`;
    for (const button of this.tools) button.setAttribute("aria-pressed", String(button.dataset.tool === tool));
    this.clear.disabled = !measures.shown.length; // hidden it would change the height of the slices
  }

  /** @param {number} zoom */
  zoomed(zoom) {
    this.zoomInput.value = String(zoom);
    this.zoomWords.textContent = `${zoom.toFixed(1)}×`;
  }

  chosen() {
    const suggested = this.board.state?.case.window;
    if (this.window.value === SCANNER && suggested) this.board.greys.set(SCANNER, suggested[0], suggested[1]);
    const preset = PRESETS.find(({ name }) => name === this.window.value);
    if (preset) this.board.greys.set(preset.name, preset.window, preset.level);
  }

  /** Another head is open: what was typed is a place of the one before. */
  forget() {
    this.place.value = "";
    this.place.removeAttribute("aria-invalid");
  }

  /** @param {KeyboardEvent} event */
  typed(event) {
    if (event.key !== "Enter") return;
    event.preventDefault();
    event.stopPropagation(); // a ghost is not confirmed by it
    this.go();
  }

  go() {
    let place;
    try {
      place = placeOf(this.place.value);
    } catch (error) {
      this.place.setAttribute("aria-invalid", "true");
      note(error instanceof Error ? error.message : String(error), { error: true });
      return;
    }
    this.place.removeAttribute("aria-invalid");
    this.place.value = placeWords(place);
    if (!this.board.holds(place)) note(`${placeWords(place)} is outside the scan; the crosshair went to its edge.`);
    this.board.crosshair.move(place);
    this.board.centreAll();
  }
}
