// A place of the head is typed where a slice says its own: a click on that opens the field.
import { note } from "../dialogs.js";
import { h } from "../dom.js";
import { complain } from "../fields.js";
import { placeOf, placeWords } from "./place-words.js";
/** @import { Slices } from "../slices.js" */
/** @import { Pane } from "./pane.js" */

export class PlaceField {
  /** @param {Slices} board */
  constructor(board) {
    this.board = board;
    /** @type {Pane | null} the slice in which it is open */
    this.pane = null;
    /** @type {HTMLInputElement} */
    this.input = h("input", {
      type: "text", id: "slice-place", placeholder: "R 24.5 A 10 S 3", autocomplete: "off", spellcheck: false, "aria-label": "Go to a place, mm",
      onkeydown: (event) => this.pressed(event), onblur: () => this.close(),
    });
    this.element = h("div", { class: "slice-goto" }, h("label", { class: "field" }, this.input));
  }

  /** @param {Pane} pane */
  open(pane) {
    this.close();
    this.pane = pane;
    const { place } = this.board.crosshair;
    this.input.value = place ? placeWords(place) : "";
    pane.head.append(this.element);
    pane.head.classList.add("typing");
    this.input.select();
    this.input.focus();
  }

  close() {
    const { pane } = this;
    if (!pane) return;
    this.pane = null;
    complain(this.input, "");
    pane.head.classList.remove("typing");
    this.element.remove();
  }

  /** @param {KeyboardEvent} event */
  pressed(event) {
    event.stopPropagation(); // a ghost is neither confirmed nor taken back by it
    const { pane } = this;
    if (event.key === "Enter") {
      event.preventDefault();
      this.go();
    } else if (event.key === "Escape") {
      event.preventDefault();
      this.close();
      pane?.where.focus();
    }
  }

  go() {
    const { board, pane } = this;
    let place;
    try {
      place = placeOf(this.input.value);
    } catch (error) {
      complain(this.input, error instanceof Error ? error.message : String(error));
      return;
    }
    if (!board.holds(place)) note(`${placeWords(place)} is outside the scan; the crosshair went to its edge.`);
    board.crosshair.move(place);
    board.centreAll();
    this.close();
    pane?.stage.focus({ preventScroll: true }); // Enter adds there
  }
}
