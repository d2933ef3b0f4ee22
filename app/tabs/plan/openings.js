// The openings of the head at which an empty path can begin: a button for each, as they are marked in scene and slices.
import { h, whenChanged } from "/static/js/dom.js";
import { JobLine } from "/static/js/job-line.js";
import { jobWatch } from "/static/js/jobs.js";
import { draw, html, nothing, repeat } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { JobPublic, OpeningsSection } from "/static/js/types.js" */

export class Openings {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.work = new JobLine();
    /** @type {string | undefined} the head whose job is followed */
    this.of = undefined;
    /** @type {OpeningsSection | undefined} */
    this.openings = undefined;
    this.element = h("div", { class: "openings", id: "openings", role: "group", "aria-label": "Openings of the head" });
    jobWatch.addEventListener("change", () => this.follow());
  }

  /** The job that finds them, whoever began it. */
  async follow() {
    const job = jobWatch.items.find(({ kind, case_id: id }) => kind === "openings" && id === this.connection.state.case?.id);
    if (!job || job.id === this.work.job) return;
    this.of = job.case_id ?? undefined;
    const ended = this.work.follow(/** @type {JobPublic} */ (job));
    this.update(this.openings);
    await ended.catch(() => {}); // the section says why there is none
    this.update(this.openings);
  }

  /** @param {OpeningsSection | undefined} openings */
  update(openings) {
    this.openings = openings;
    if (this.work.job && this.of !== this.connection.state.case?.id) this.work.leave();
    this.changed([openings, this.work.job], () => this.render(openings));
  }

  /** @param {OpeningsSection | undefined} openings */
  render(openings) {
    const { state, items, words } = openings ?? { state: "none", items: [], words: "" };
    this.element.hidden = state === "none";
    const said = state !== "waiting" ? words : this.work.job ? "" : "Finding the nostrils …"; // the job says it
    draw(this.element, html`
      ${items.length ? html`<div class="buttons even">${repeat(items, ({ id }) => id, ({ id, name }) => html`
        <button type="button" data-opening=${id} data-command=${`opening.${id}`} title="The path enters here"
          @click=${() => this.connection.send("opening.use", { opening_id: id })}>${name}</button>`)}</div>` : nothing}
      ${this.work.element}
      <p class="words" role="status" ?hidden=${!said}>${said}</p>`);
  }
}
