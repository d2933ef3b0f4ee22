// The menu of the slices: zoom, outlines, following the tip, and what opens from it: the second volume, and the keys.
import { h, iconButton } from "../dom.js";
import { Popover } from "../popover.js";
import { SHORTCUTS } from "../shortcuts.js";
import { draw, html, live } from "../template.js";
/** @import { Slices } from "../slices.js" */

export class SliceMenu {
  /**
   * @param {Slices} board
   * @param {HTMLButtonElement} button opens it
   */
  constructor(board, button) {
    this.board = board;
    this.zoom = 2;
    this.element = h("div", { class: "slice-menu", role: "dialog", "aria-label": "Slice menu" });
    this.popover = new Popover(this.element, { button, sides: ["right", "above", "below"] });
    this.volume = h("div", { class: "volume-menu", role: "dialog", "aria-label": "Second volume" },
      h("div", { class: "popover-head" }, h("h2", {}, "Second volume"), iconButton("blocked", "Close", () => this.second.hide(), { title: "Close (Esc)" })), board.second.element);
    this.second = new Popover(this.volume, { home: button, beside: board.root, sides: ["left", "above", "below"] });
    this.keys = h("div", { class: "keys-menu", role: "dialog", "aria-label": "Mouse and keys" },
      h("div", { class: "popover-head" }, h("h2", {}, "Mouse and keys"), iconButton("blocked", "Close", () => this.help.hide(), { title: "Close (Esc)" })), keysOfSlices());
    this.help = new Popover(this.keys, { home: button, beside: board.root, sides: ["left", "above", "below"] });
  }

  get popovers() {
    return [this.element, this.volume, this.keys];
  }

  update() {
    const { board } = this;
    draw(this.element, html`
      <label class="field"><span class="field-label">Zoom <span class="number">${this.zoom.toFixed(1)}×</span></span>
        <input type="range" id="slice-zoom" min="1" max="12" step="0.25" .value=${live(String(this.zoom))} @input=${this.zoomed}></label>
      <label class="check"><input type="checkbox" id="slice-outlines" .checked=${live(board.outlines.on)} @change=${this.outline}>Outlines</label>
      <label class="check" ?hidden=${!board.tip.place}><input type="checkbox" id="follow-tip" .checked=${live(board.tip.on)} @change=${this.follow}>Follow the tip</label>
      <button type="button" class="plain" id="second-volume" ?hidden=${!board.second.offered} @click=${() => this.open(this.second)}>Second volume …</button>
      <button type="button" class="plain" id="slice-keys" @click=${() => this.open(this.help)}>Mouse and keys …</button>`);
  }

  /** @param {Popover} popover */
  open(popover) {
    this.popover.hide();
    popover.show();
  }

  zoomed = (/** @type {Event} */ { currentTarget }) => {
    this.board.zoomAll(Number(/** @type {HTMLInputElement} */ (currentTarget).value));
  };

  outline = (/** @type {Event} */ { currentTarget }) => {
    this.board.outline(/** @type {HTMLInputElement} */ (currentTarget).checked);
  };

  follow = (/** @type {Event} */ { currentTarget }) => {
    this.board.tip.set(/** @type {HTMLInputElement} */ (currentTarget).checked);
  };
}

function keysOfSlices() {
  const rows = SHORTCUTS.find(([title]) => title === "Slices")?.[1] ?? [];
  return h("dl", { class: "keys" }, rows.flatMap(({ keys, words }) => [h("dt", {}, keys), h("dd", {}, words)]));
}
