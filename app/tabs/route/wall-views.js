// Which part of the wall the robot of the open route can view: searched on request, as a job of minutes, and tinted in 3D.
import { h } from "/static/js/dom.js";
import { fixed } from "/static/js/format.js";
import { JobLine } from "/static/js/job-line.js";
import { jobWatch } from "/static/js/jobs.js";
import { draw, html, live, nothing, said } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { JobPublic, WallViewsSection } from "/static/js/types.js" */

export class WallViews {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.work = new JobLine();
    this.element = h("div", { class: "group", hidden: true });
    /** @type {WallViewsSection | undefined} */
    this.section = undefined;
    jobWatch.addEventListener("change", () => this.follow());
  }

  /** The job that searches, whoever began it. */
  async follow() {
    const job = jobWatch.items.find(({ kind, document_id: id }) => kind === "viewable" && id === this.connection.state.route?.id);
    if (!job || job.id === this.work.job) return;
    const ended = this.work.follow(/** @type {JobPublic} */ (job));
    this.update(this.section);
    await ended.catch(() => {}); // the section says why there is none
    this.update(this.section);
  }

  /** @param {WallViewsSection | undefined} section undefined without a pathway */
  update(section) {
    this.section = section;
    this.element.hidden = !section;
    if (!section) return;
    const { state, words, share, depth_mm, shown } = section;
    const show = (/** @type {Event} */ { currentTarget }) => this.connection.send("route.viewable", { shown: /** @type {HTMLInputElement} */ (currentTarget).checked });
    draw(this.element, share === null
      ? html`${this.work.element}<p class=${state === "failed" ? "words caution" : "words"} ?hidden=${!words}>${words ? said(words) : nothing}</p>
        <button type="button" class="wide" id="find-viewable" title="Takes minutes in a whole colon." ?hidden=${state === "computing"} @click=${() => this.connection.send("route.viewable")}>Viewable wall</button>`
      : html`<dl class="facts" id="viewable"><dt>Viewable</dt><dd>${fixed(100 * share, 0)} % of the wall to ${fixed(depth_mm, 0)} mm</dd></dl>
        <label class="check"><input type="checkbox" id="show-viewable" .checked=${live(shown)} @change=${show}>Tint viewable wall</label>`);
  }
}
