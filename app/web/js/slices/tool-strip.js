// Upon the first slice: what the mouse does, the grey values, and a menu of what is rarer.
import { h } from "../dom.js";
import { paintBrush } from "../paint-brush.js";
import { Roving } from "../roving.js";
import { draw, html, iconTemplate } from "../template.js";
import { GreyMenu } from "./grey-menu.js";
import { SliceMenu } from "./slice-menu.js";
/** @import { ICONS } from "../dom.js" */
/** @import { Slices, Tool } from "../slices.js" */

/** @type {[Tool, string, string, keyof typeof ICONS][]} name, word, what the mouse does, picture */
const TOOLS = [
  ["cross", "Point", "Click adds a point, or moves the crosshair.", "cross"],
  ["window", "Window", "Drag sets window and level.", "window"],
  ["distance", "Distance", "Click two places.", "distance"],
  ["angle", "Angle", "Click three places, the corner second.", "angle"],
  ["paint", "Paint", "Drag paints the label.", "paint"],
];
/** What a click adds to the plan. */
const ADDS = { point: "Click adds a path point.", target: "Click adds a target.", none: "" };

/**
 * What the mouse does now.
 * @param {Slices} board
 */
export function toolHint({ tool, adds, state }) {
  if (tool !== "cross") return TOOLS.find(([name]) => name === tool)?.[2] ?? "";
  if (!adds) return "Click moves the crosshair.";
  return state?.regions?.drawing ? "Click adds a place." : ADDS[state?.plan?.add_mode ?? "none"];
}

export class ToolStrip {
  /** @param {Slices} board */
  constructor(board) {
    this.board = board;
    this.tools = h("div", { class: "slice-tools", role: "toolbar", "aria-label": "Slice tools" });
    this.more = h("button", { type: "button", "data-tool": "more", title: "Zoom, outlines, second volume", "aria-label": "More slice tools" });
    draw(this.more, html`${iconTemplate("adjust")}<span class="tool-word">More</span>`);
    this.greys = new GreyMenu(board);
    this.menu = new SliceMenu(board, this.more);
    this.pressable = h("div", { class: "slice-tool-buttons" });
    this.tools.append(this.pressable, this.more);
    this.element = h("div", { class: "slice-controls", "data-live": "" }, this.tools, this.greys.button);
    this.roving = new Roving(this.tools, "button:not([hidden])", { axis: "both", first: "[aria-pressed='true']" });
    for (const subject of [board.greys, board.measures, paintBrush]) subject.addEventListener("change", () => this.update());
  }

  /** Those of the menus' popovers that stand in the slices. */
  get popovers() {
    return [this.greys.element, ...this.menu.popovers];
  }

  update() {
    const { measures, tool } = this.board;
    const shown = TOOLS.filter(([name]) => name !== "paint" || (paintBrush.label && !paintBrush.label.locked));
    draw(this.pressable, html`
      ${shown.map(([name, word, title, picture]) => html`<button type="button" data-tool=${name} title=${`${word}: ${title}`} aria-pressed=${String(name === tool)}
        @click=${() => this.board.choose(name)}>${iconTemplate(picture)}<span class="tool-word">${word}</span></button>`)}
      <button type="button" data-tool="clear" title="Clear all measures" ?hidden=${!measures.shown.length} @click=${() => this.clear()}>${iconTemplate("trash")}<span class="tool-word">Clear</span></button>`);
    this.greys.update();
    this.menu.update();
    this.roving.update();
  }

  clear() {
    this.more.focus(); // the button leaves with the measures
    this.board.measures.clear();
  }
}
