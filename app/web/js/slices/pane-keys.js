// A slice by keyboard alone: crosshair, slice, adding a point, lifting one and carrying it.
import { letterOf } from "../letters.js";
import { plus } from "./vectors.js";
/** @import { Triple } from "./grid.js" */
/** @import { Pane } from "./pane.js" */

/** @typedef {{ id: string, from: Triple, at: Triple }} Lifted a point or target that the arrows carry */

const PAGE = 1; // slices that a Page key goes

export class PaneKeys {
  /** @param {Pane} pane */
  constructor(pane) {
    this.pane = pane;
    /** @type {Lifted | null} */
    this.lifted = null;
  }

  /** @param {HTMLElement} stage */
  listen(stage) {
    stage.addEventListener("keydown", (event) => {
      if (!this.pressed(event)) return;
      event.preventDefault();
      event.stopPropagation();
    });
    stage.addEventListener("blur", () => this.putBack());
  }

  /**
   * Whether a key was meant for the slice.
   * @param {KeyboardEvent} event
   */
  pressed(event) {
    if (event.ctrlKey || event.metaKey) return false;
    const { u, v } = this.pane.axes();
    /** @type {Record<string, [Triple, number]>} */
    const ways = { ArrowRight: [u, 1], ArrowLeft: [u, -1], ArrowDown: [v, 1], ArrowUp: [v, -1] };
    const way = ways[event.key];
    if (way) {
      this.move(way[0], way[1] * (event.shiftKey ? 5 : event.altKey ? 0.1 : 1));
      return true;
    }
    if (event.altKey || event.shiftKey) return false;
    switch (event.key) {
      case "PageUp": return this.page(PAGE);
      case "PageDown": return this.page(-PAGE);
      case "Enter": return event.repeat || this.entered();
      case "Escape": return this.putBack() || (!this.pane.board.halfDone && this.pane.board.escape());
      case " ": return this.drawHere();
    }
    switch (letterOf(event)) {
      case "M": return this.lift();
      case "C": return this.centre();
      default: return false;
    }
  }

  /**
   * Carry what is lifted, else the crosshair.
   * @param {Triple} way
   * @param {number} far mm
   */
  move(way, far) {
    const { crosshair, connection } = this.pane.board;
    if (this.lifted) {
      this.lifted.at = plus(this.lifted.at, way, far);
      connection.send("item.drag", { item_id: this.lifted.id, position: this.lifted.at });
      crosshair.move(this.lifted.at);
    } else if (crosshair.place) crosshair.move(plus(crosshair.place, way, far));
    this.pane.follow();
  }

  /** @param {number} slices */
  page(slices) {
    this.pane.goBy(slices);
    return true;
  }

  centre() {
    const { place } = this.pane.board.crosshair;
    if (place) this.pane.centre(place);
    return true;
  }

  /** Drop what is lifted; else measure or add a point at the crosshair. A ghost is confirmed by the page. */
  entered() {
    const { board } = this.pane;
    const { place } = board.crosshair;
    if (this.lifted) {
      board.connection.send("item.drop", { item_id: this.lifted.id });
      this.lifted = null;
      board.tell("Dropped.");
    } else if (place && (board.tool === "distance" || board.tool === "angle")) board.measure(place);
    else if (board.state?.regions?.drawing?.places.length) return false; // the page ends the chain
    else if (place && board.adds && !board.state?.plan?.ghost) board.connection.send("pick.slice", { position: place });
    else return false;
    return true;
  }

  /** A place of the chain that is being drawn, at the crosshair: Enter ends the chain. */
  drawHere() {
    const { board } = this.pane;
    const { place } = board.crosshair;
    if (!place || !board.state?.regions?.drawing) return false;
    board.connection.send("pick.slice", { position: place });
    return true;
  }

  lift() {
    const { board } = this.pane;
    const plan = board.state?.plan;
    if (board.state?.step?.input !== "edit" || !plan || plan.locked || this.lifted) return false;
    const item = [...plan.points, ...plan.targets].find(({ id }) => id === plan.selected);
    if (!item) {
      board.tell("Choose a point or target first.");
      return true;
    }
    this.lifted = { id: item.id, from: item.position, at: item.position };
    board.crosshair.move(item.position);
    this.pane.follow();
    board.tell(`${item.label} is lifted: arrows carry it, Enter drops it, Escape returns it.`);
    return true;
  }

  /** What is lifted goes back to where it was; returns whether something was. */
  putBack() {
    const { board } = this.pane;
    if (!this.lifted) return false;
    board.connection.send("ghost.cancel"); // lets go of what is dragged, and stores nothing
    board.crosshair.move(this.lifted.from);
    this.lifted = null;
    board.tell("Returned to where it was.");
    return true;
  }
}
