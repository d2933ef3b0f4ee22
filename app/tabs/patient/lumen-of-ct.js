// Another lumen of the open case's CT: the air at the crosshair of the slices.
import { h } from "/static/js/dom.js";
import { note } from "/static/js/dialogs.js";
import { numberOf } from "/static/js/fields.js";
import { fixed } from "/static/js/format.js";
import { send } from "/static/js/rest.js";
import { draw, html } from "/static/js/template.js";

/** @import { JobList } from "/static/js/job-list.js" */
/** @import { CaseSection, JobPublic } from "/static/js/types.js" */

export class LumenOfCt {
  /** @param {JobList} jobs */
  constructor(jobs) {
    this.jobs = jobs;
    this.element = h("div", { class: "fields" });
    this.air = "-500"; // HU
    /** @type {CaseSection | null} */
    this.case = null;
    /** @type {number[] | null} */
    this.cross = null;
  }

  /**
   * @param {CaseSection | null | undefined} open
   * @param {number[] | null | undefined} cross where the crosshair stands, LPS mm
   */
  update(open, cross) {
    [this.case, this.cross] = [open ?? null, cross ?? null];
    const typed = (/** @type {Event} */ { currentTarget }) => { this.air = /** @type {HTMLInputElement} */ (currentTarget).value; };
    draw(this.element, html`<p class="words">Click into the lumen in a slice. ${cross ? html`<span class="number">${cross.map((value) => fixed(value, 0)).join(", ")} mm</span>` : ""}</p>
      <label class="field"><span class="field-label">Air up to, HU</span><input type="text" inputmode="numeric" id="lumen-air" .value=${this.air} @change=${typed}></label>
      <button type="button" class="wide" id="take-lumen" ?disabled=${!cross} @click=${this.take}>Take this air</button>`);
  }

  take = async () => {
    const { case: open, cross } = this, air_hu = numberOf(this.air);
    if (!open || !cross) return;
    try {
      if (!Number.isFinite(air_hu)) throw new Error("the threshold is a number of HU, such as −500.");
      /** @type {JobPublic} */
      const job = await send(`/api/v1/cases/${encodeURIComponent(open.id)}/lumen`, { seed: cross, air_hu });
      this.jobs.watch(job);
    } catch (error) {
      note(/** @type {Error} */ (error).message, { error: true });
    }
  };
}
