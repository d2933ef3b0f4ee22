// Painting on the slices: a stroke is drawn here at once, and is one command to the planner, which stores the label.
import { note } from "../dialogs.js";
import { h } from "../dom.js";
import { paintBrush } from "../paint-brush.js";
/** @import { Slices } from "../slices.js" */
/** @import { Triple } from "./grid.js" */
/** @import { Brush } from "./label-paint.js" */
/** @import { Pane } from "./pane.js" */

const MOST_POINTS = 500; // of a command; a longer stroke goes on as another one
const STEP = 0.2; // [radius] between two points of a stroke

export class Painting {
  /** @param {Slices} board */
  constructor(board) {
    this.board = board;
    this.ring = h("div", { class: "brush-ring", hidden: true });
    /** @type {(Brush & { points: Triple[] }) | null} the stroke that is being drawn */
    this.stroke = null;
    this.shown = ""; // the label that the worker has
    this.expected = 0; // its revision, with the strokes that were drawn here
    this.pending = 0; // strokes that the planner has not answered
    paintBrush.addEventListener("change", () => this.changed());
    board.link.addEventListener("change", () => this.changed());
    board.link.addEventListener("labelled", () => this.redraw());
    board.link.addEventListener("unlabelled", () => note(`The label cannot be shown: ${board.link.laidWords}.`, { error: true }));
  }

  /** Another label, brush, revision or colour; or the voxels have come. */
  changed() {
    const { board } = this;
    if (paintBrush.held !== (board.tool === "paint")) board.choose(paintBrush.held ? "paint" : "cross");
    if (!paintBrush.held) this.ring.hidden = true;
    if (!board.link.ready) this.shown = "";
    else this.show();
  }

  /** Bring the label to the worker where it has another one, or strokes of somebody else, or none that was undone. */
  show() {
    const label = paintBrush.label?.caseId === this.board.link.caseId ? paintBrush.label : null; // else of the head before
    const key = label ? `${label.id} ${label.colour}` : "";
    const newer = label && !this.pending && !this.stroke && label.revision !== this.expected;
    if (key === this.shown && !newer) return;
    this.shown = key;
    this.expected = label?.revision ?? 0;
    this.board.link.showLabel(label);
  }

  redraw() {
    this.board.plan(() => { for (const pane of this.board.panes) pane.refresh(); });
  }

  /**
   * @param {Pane} pane
   * @param {Triple | null} place
   */
  begin(pane, place) {
    if (!place || paintBrush.label?.caseId !== this.board.link.caseId) return;
    this.stroke = { mode: paintBrush.mode, brush: paintBrush.brush, radius_mm: paintBrush.radius, normal: pane.axes().n, points: [] };
    this.add(place);
  }

  /** @param {Triple | null} place */
  go(place) {
    const { stroke } = this;
    if (!stroke || !place) return;
    const last = stroke.points[stroke.points.length - 1];
    if (Math.hypot(...place.map((value, axis) => value - last[axis])) < STEP * stroke.radius_mm) return;
    this.add(place);
    if (stroke.points.length < MOST_POINTS) return;
    this.end();
    this.stroke = { ...stroke, points: [] };
    this.add(place);
  }

  /** @param {Triple} place */
  add(place) {
    const { stroke } = this;
    if (!stroke) return;
    const rounded = /** @type {Triple} */ (place.map((value) => Math.round(value * 1000) / 1000));
    const last = stroke.points[stroke.points.length - 1] ?? rounded;
    stroke.points.push(rounded);
    const { mode, brush, radius_mm, normal } = stroke;
    this.board.link.paint({ mode, brush, radius_mm, normal }, last, rounded);
    this.redraw();
  }

  /** The stroke is finished: the planner stores it. */
  async end() {
    const { stroke } = this;
    const { label } = paintBrush;
    this.stroke = null;
    if (!stroke || !label) return;
    this.pending += 1;
    try {
      await this.board.connection.request("label.stroke", { label_id: label.id, ...stroke });
      this.expected += 1;
    } catch (error) {
      this.expected = -1; // what was drawn here is not kept: the planner's voxels are brought
      note(`The stroke was not kept: ${error instanceof Error ? error.message : error}`, { error: true });
    }
    this.pending -= 1;
    this.show();
  }

  /**
   * The outline of the brush at the pointer.
   * @param {Pane} pane
   * @param {[number, number]} at CSS pixels
   */
  point(pane, [x, y]) {
    const size = 2 * paintBrush.radius / pane.perPixel();
    if (this.ring.parentElement !== pane.stage) pane.stage.append(this.ring);
    this.ring.hidden = !paintBrush.held;
    this.ring.dataset.mode = paintBrush.mode;
    Object.assign(this.ring.style, { left: `${x}px`, top: `${y}px`, width: `${size}px`, height: `${size}px` });
  }
}
