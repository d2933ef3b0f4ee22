// Comments on the drive: whoever watches writes one at its present time, and every window reads it.
import { commentForm, commentTime } from "/static/js/comments.js";
import { note } from "/static/js/dialogs.js";
import { h } from "/static/js/dom.js";
import { draw, html, nothing, repeat, titled } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { CommentView, RehearsalSection, ViewModel } from "/static/js/types.js" */

const SHOWN = 5;

export class CommentsGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.element = h("div", { class: "group", id: "drive-comments", hidden: true });
    /** @type {CommentView[] | undefined} newest first, as they were drawn last */
    this.shown = undefined;
    this.open = false;
    /** @type {Set<string>} texts that this window has sent */
    this.own = new Set();
  }

  /** @param {ViewModel} state */
  update({ rehearsal }) {
    /** @type {Partial<RehearsalSection>} */
    const { state = "absent", comments = [], unrecorded } = rehearsal ?? {};
    const open = ["running", "paused"].includes(state) && !unrecorded;
    if (comments === this.shown && open === this.open) return;
    const [newest] = comments, known = this.shown?.some(({ id }) => id === newest?.id) ?? true;
    Object.assign(this, { shown: comments, open });
    if (newest && !known && !this.own.delete(newest.text)) note(`Comment: ${newest.text}`);
    this.element.hidden = !open && !comments.length;
    draw(this.element, titled("Comments", null, html`
      ${open ? commentForm("drive-comment", "Comment", (text) => this.send(text)) : nothing}
      <ul class="run-comments" aria-label="Comments">${repeat(comments.slice(0, SHOWN), ({ id }) => id, ({ t_s: t, text }) => html`<li><span>${text}</span><span class="number">${commentTime(t)}</span></li>`)}</ul>`));
  }

  /** Returns whether it was stored. @param {string} text */
  async send(text) {
    this.own.add(text);
    try {
      await this.connection.request("rehearsal.comment", { text });
      return true;
    } catch (error) {
      this.own.delete(text);
      note(error instanceof Error ? error.message : String(error), { error: true });
      return false;
    }
  }
}
