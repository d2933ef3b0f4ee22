// A chosen bead or point of a registration, near enough to be judged; the zoom from before comes back with no choice.
/** @import { Slices } from "../slices.js" */
/** @import { Pane } from "./pane.js" */
/** @import { ViewModel } from "../types.js" */

const FIELD_MM = 30; // that a slice shows across

export class CloseUp {
  /** @param {Slices} board */
  constructor(board) {
    this.board = board;
    this.chosen = "";
    /** @type {Map<Pane, { before: number, near: number }>} zooms of the slices that were brought near */
    this.zooms = new Map();
  }

  /** @param {ViewModel} state */
  heard({ fiducials }) {
    const mark = fiducials?.items.find(({ selected }) => selected);
    if ((mark?.id ?? "") === this.chosen) return;
    this.chosen = mark?.id ?? "";
    if (!mark) {
      this.back();
      return;
    }
    for (const pane of this.board.panes) if (pane.name !== "path" && pane.stage.clientWidth) this.near(pane, mark.position);
  }

  /**
   * @param {Pane} pane
   * @param {[number, number, number]} position
   */
  near(pane, position) {
    const across = Math.min(pane.stage.clientWidth, pane.stage.clientHeight) * pane.perPixel();
    if (across > FIELD_MM) {
      const before = this.zooms.get(pane)?.before ?? pane.zoom;
      pane.zoomTo((pane.zoom * across) / FIELD_MM);
      this.zooms.set(pane, { before, near: pane.zoom });
      this.board.zoomed(pane.zoom);
    }
    pane.centre(position);
  }

  /** A slice that the user zoomed meanwhile is not changed. */
  back() {
    for (const [pane, { before, near }] of this.zooms) {
      if (pane.zoom !== near) continue;
      pane.zoomTo(before);
      this.board.zoomed(before);
    }
    this.zooms.clear();
  }
}
