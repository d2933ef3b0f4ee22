// A job that is followed in place, beside the button that began it.
import { h } from "./dom.js";
import { sentence } from "./format.js";
import { finished, stageWords } from "./jobs.js";
import { remove, send, wasCancelled } from "./rest.js";

/** @import { JobEntry, JobPublic } from "./types.js" */

/** A job that is followed, with its stage, a bar and a button that cancels it. */
export class JobLine {
  constructor() {
    /** @type {string | null} */
    this.job = null;
    this.stage = h("p", { class: "words" });
    this.bar = h("div");
    this.cancelButton = h("button", { type: "button", "data-tool": "cancel", onclick: () => this.cancel() }, "Cancel");
    this.element = h("div", { class: "job", hidden: true }, this.stage, h("div", { class: "progress" }, this.bar), this.cancelButton);
  }

  /**
   * Start a job and wait for what it made; null where it was cancelled.
   * @param {string} path
   * @param {object} request
   */
  async run(path, request) {
    return this.follow(await send(path, request));
  }

  /**
   * Wait for what a job that was started makes; null where it was cancelled.
   * @param {JobEntry & Partial<JobPublic>} job
   */
  async follow(job) {
    this.show(job);
    this.job = job.id;
    this.cancelButton.disabled = false;
    try {
      return (await finished(job, (now) => { if (this.job === job.id) this.show(now); })).result;
    } catch (error) {
      if (wasCancelled(error)) return null;
      throw error;
    } finally {
      if (this.job === job.id) this.leave(); // else another one is followed
    }
  }

  /** Follow none any more; what is followed goes on. */
  leave() {
    this.job = null;
    this.element.hidden = true;
  }

  /** @param {JobEntry} now */
  show(now) {
    this.element.hidden = false;
    this.stage.textContent = sentence(stageWords(now));
    this.bar.style.width = `${Math.round(now.fraction * 100)}%`;
  }

  async cancel() {
    this.cancelButton.disabled = true;
    if (this.job) await remove(`/api/v1/jobs/${encodeURIComponent(this.job)}`).catch(() => { this.cancelButton.disabled = false; });
  }
}
