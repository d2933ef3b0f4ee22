// The menu of grey values upon a slice; its button says which are in force.
import { h } from "../dom.js";
import { Popover } from "../popover.js";
import { Roving } from "../roving.js";
import { draw, html } from "../template.js";
import { OWN, PRESETS, SCANNER } from "./grey-values.js";
/** @import { Slices } from "../slices.js" */
/** @import { Preset } from "./grey-values.js" */

/**
 * 'W 2000 L −200'
 * @param {{ window: number, level: number }} greys HU
 */
export function greyWords({ window, level }) {
  return `W ${Math.round(window)} L ${String(Math.round(level)).replace("-", "−")}`;
}

export class GreyMenu {
  /** @param {Slices} board */
  constructor(board) {
    this.board = board;
    this.button = h("button", { type: "button", class: "slice-window number", "aria-haspopup": "menu", title: "Grey values: window and level, HU" });
    this.element = h("div", { class: "grey-menu", role: "menu", "aria-label": "Grey values" });
    this.roving = new Roving(this.element, "button", { first: "[aria-checked='true']" });
    this.popover = new Popover(this.element, { button: this.button, sides: ["above", "below"] });
  }

  /** The usual ones, what the scanner suggests, and what was dragged to. @returns {Preset[]} */
  get choices() {
    const { greys, state } = this.board;
    const suggested = state?.case.window;
    const known = suggested ? [...PRESETS, { name: SCANNER, label: "Scanner", window: suggested[0], level: suggested[1] }] : PRESETS;
    if (known.some(({ name }) => name === greys.name)) return known;
    return [...known, { name: OWN, label: "Dragged", window: greys.window, level: greys.level }];
  }

  update() {
    const { greys } = this.board;
    const { choices } = this;
    const now = choices.find(({ name }) => name === greys.name) ?? choices[choices.length - 1];
    draw(this.button, html`<span class="slice-window-name">${now.label}</span> ${greyWords(greys)}`);
    draw(this.element, html`${choices.map((choice) => html`<button type="button" role="menuitemradio" data-greys=${choice.name} aria-checked=${String(choice === now)}
      @click=${() => this.choose(choice)}><span>${choice.label}</span><span class="number quiet">${greyWords(choice)}</span></button>`)}`);
    this.roving.update();
  }

  /** @param {Preset} choice */
  choose({ name, window, level }) {
    if (name !== OWN) this.board.greys.set(name, window, level);
    this.popover.hide();
  }
}
