// The slices follow the tip of a tool that is driven.
import { keep, recall } from "../remember.js";
/** @import { Slices } from "../slices.js" */
/** @import { Triple } from "./grid.js" */

const FOLLOW_MS = 250; // a moving tip moves the planner's slices no more often
const FOLLOW_MM = 0.4;

export class TipFollower {
  /** @param {Slices} board */
  constructor(board) {
    this.board = board;
    this.on = recall("follow-tip", ["on", "off"], "on") === "on";
    /** @type {Triple | undefined} where it is, while a robot is shown */
    this.place = undefined;
    /** @type {Triple | null} where the slices followed it last */
    this.followed = null;
    /** @type {ReturnType<typeof setTimeout> | null} */
    this.timer = null;
  }

  /** @param {Triple | undefined} place */
  at(place) {
    this.place = place;
    this.follow();
  }

  /** @param {boolean} on */
  set(on) {
    this.on = on;
    keep("follow-tip", on ? "on" : "off");
    this.followed = null;
    this.follow();
  }

  /** Bring the slices to the newest place, at most once in FOLLOW_MS. */
  follow() {
    const [from, to] = [this.followed, this.place];
    if (!this.on || !to || this.timer) return;
    if (from && Math.hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]) < FOLLOW_MM) return;
    this.timer = setTimeout(() => {
      this.timer = null;
      const { board, place } = this;
      if (!this.on || !place || !board.connection.connected) return;
      this.followed = place;
      if (board.frames) board.along = board.frames.nearest(place);
      board.crosshair.move(place);
      for (const pane of board.panes) if (pane.name !== "path") pane.follow();
      this.follow();
    }, FOLLOW_MS);
  }
}
