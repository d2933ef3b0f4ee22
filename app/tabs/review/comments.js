// Comments on the open run: each opens its moment; a new one is at the time that is shown.
import { addComment, changeComment, commentForm, commentTime, deleteComment, MOST_CHARACTERS } from "/static/js/comments.js";
import { askName } from "/static/js/dialogs.js";
import { h } from "/static/js/dom.js";
import { fixed } from "/static/js/format.js";
import { draw, html, iconTool, repeat, titled } from "/static/js/template.js";

/** @import { CommentPublic, RunTitle } from "/static/js/types.js" */
/** @import { Player } from "./player.js" */

export class RunComments {
  /**
   * @param {Player} player
   * @param {{ changed: (run: string, change: (comments: CommentPublic[]) => CommentPublic[]) => void, failed: (error: unknown) => void, goTo: (t: number) => void }} wishes
   */
  constructor(player, wishes) {
    this.player = player;
    this.wishes = wishes;
    this.element = h("div", { class: "group", id: "run-comments", hidden: true });
    /** @type {RunTitle | null} */
    this.run = null;
    player.addEventListener("change", () => this.render());
  }

  /** @param {RunTitle | null} run the open one, with its replay */
  of(run) {
    this.run = run;
    this.element.hidden = !run;
    this.render();
  }

  render() {
    const { run, player } = this;
    if (!run) return;
    draw(this.element, titled("Comments", null, html`
      ${commentForm("run-comment", `At ${fixed(player.t, 1)} s`, (text) => this.tell(run, addComment(run.id, player.t, text), (said, now) => [...now, said]))}
      <ul class="list plain-rows run-comments" aria-label="Comments">${repeat(run.comments, ({ id }) => id, (comment) => this.row(run, comment))}</ul>`));
  }

  /** @param {RunTitle} run @param {CommentPublic} comment */
  row(run, comment) {
    const { id, t_s: t, text } = comment;
    const gone = () => this.tell(run, deleteComment(run.id, id).then(() => id), (deleted, now) => now.filter((one) => one.id !== deleted));
    return html`<li class="row" data-comment=${id}>
      <button type="button" class="row-main" ?disabled=${t === null} title="Show this moment" @click=${() => this.wishes.goTo(t ?? 0)}><span>${text}</span><span class="number">${commentTime(t)}</span></button>
      <div class="row-tools">${iconTool("pencil", "Change comment", () => this.change(run, comment))}${iconTool("trash", "Delete comment", gone)}</div></li>`;
  }

  /** @param {RunTitle} run @param {CommentPublic} comment */
  async change(run, { id, text: before }) {
    const text = await askName("Change comment", before, "Save", { label: "Comment", most: MOST_CHARACTERS });
    if (text === null || text === before) return;
    this.tell(run, changeComment(run.id, id, text), (said, now) => now.map((one) => (one.id === id ? said : one)));
  }

  /**
   * Show what the planner has stored, beside what is there by then. Returns whether it was stored.
   * @template Answer
   * @param {RunTitle} run
   * @param {Promise<Answer>} request
   * @param {(answer: Answer, now: CommentPublic[]) => CommentPublic[]} after
   */
  async tell({ id }, request, after) {
    try {
      const answer = await request;
      this.wishes.changed(id, (now) => after(answer, now).sort((a, b) => a.step - b.step));
      return true;
    } catch (error) {
      this.wishes.failed(error);
      return false;
    }
  }
}
