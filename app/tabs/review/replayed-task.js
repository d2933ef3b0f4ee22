// Tells the planner which moment of a run of a task is shown: it draws polyps and labels as they were then, as in a drive.

/** @import { Connection } from "/static/js/connection.js" */
/** @import { Player } from "./player.js" */

const EVERY_MS = 100; // at most, while a run plays

export class ReplayedTask {
  /**
   * @param {Pick<Connection, "send" | "on">} connection
   * @param {Player} player
   */
  constructor(connection, player) {
    this.connection = connection;
    this.player = player;
    /** @type {string | null} id of the run, null for none of a task */
    this.run = null;
    this.told = "";
    /** @type {number | undefined} */
    this.timer = undefined;
    player.addEventListener("change", () => this.tell());
    connection.on("link", ({ again }) => { if (again) this.forget(); }); // a planner that was started anew knows of none
  }

  /** @param {string | null} run of a task that is played, null for none */
  of(run) {
    this.run = run;
    this.tell();
  }

  /** The planner has forgotten what it was told, as after the tab was left. */
  forget() {
    this.told = "";
  }

  /** The newest moment, and while there are many of them only some. */
  tell() {
    const fields = { run: this.run, t_s: this.run === null ? 0 : Number(this.player.t.toFixed(3)) }, now = JSON.stringify(fields);
    if (this.timer !== undefined || now === this.told || (this.run === null && !this.told)) return;
    this.told = now;
    this.connection.send("review.moment", fields);
    this.timer = setTimeout(() => {
      this.timer = undefined;
      this.tell();
    }, EVERY_MS);
  }
}
