// What the planner works at: its jobs with stage, fraction and a button that cancels.
import { h, keyed } from "./dom.js";
import { finished, jobWatch, stageWords } from "./jobs.js";
import { remove } from "./rest.js";

/** @import { Row } from "./dom.js" */
/** @import { JobEntry, JobPublic } from "./types.js" */

/**
 * Displayed jobs: those that a user waits for.
 * @type {Partial<Record<JobEntry["kind"], string>>}
 */
const KINDS = { import: "Import", structures: "Import", overlay: "Import", segmentation: "Segmentation" };

/** @param {JobEntry} job */
export function jobWords(job) {
  return `${[KINDS[job.kind], job.subject && `‘${job.subject}’`].filter(Boolean).join(" ")}: ${stageWords(job)}`;
}

/**
 * Which jobs a list is about. holds: whether a job is one of them as the page is now; of another plan it goes on without
 * being shown. words: what a row says. begun: called once before a job is first shown, whoever began it.
 * @typedef {{ holds: (job: JobEntry) => boolean, words: (job: JobEntry) => string, begun: (job: JobEntry) => void }} About
 */

/**
 * Running jobs of some kind, followed in place: a reloaded page, and another window, finds them in the planner's list.
 * `ended(job, error)` is called once for each when it has ended, with what it failed with or was cancelled by.
 */
export class JobList extends EventTarget {
  /**
   * @param {(job: JobEntry & Partial<JobPublic>, error: unknown) => unknown} ended
   * @param {Partial<About>} [about] by default what a user waits for in Patient, looked for while the list is visible
   */
  constructor(ended, about = {}) {
    super();
    this.ended = ended;
    this.holds = about.holds ?? ((job) => Boolean(KINDS[job.kind]));
    this.words = about.words ?? jobWords;
    this.begun = about.begun ?? (() => {});
    this.always = Boolean(about.holds);
    /** @type {{ holds: (job: JobEntry) => boolean, element: HTMLElement }[]} */
    this.others = [];
    /** @type {Map<string, JobEntry>} by id, as last reported */
    this.jobs = new Map();
    this.element = h("ul", { class: "jobs", hidden: true });
    jobWatch.addEventListener("change", () => this.look());
    this.look();
  }

  /**
   * A list of its own for some of the jobs, beside the button that begins them; a job is in the first that holds it.
   * @param {(job: JobEntry) => boolean} holds
   */
  beside(holds) {
    const element = h("ul", { class: "jobs", hidden: true });
    this.others.push({ holds, element });
    return element;
  }

  /** The jobs that are shown. */
  get shown() {
    return [...this.jobs.values()].filter(this.holds);
  }

  /** Find running jobs; those of Patient while the list is visible or nothing is known yet. */
  look() {
    if (this.looked && !this.always && !this.element.isConnected) return;
    for (const job of jobWatch.items) if (this.holds(job)) this.watch(job);
    this.looked = jobWatch.heard > 0;
  }

  /** What is held may be another one: find and show that. */
  again() {
    this.look();
    this.render();
  }

  /**
   * Show a job until it has ended.
   * @param {JobEntry} job
   */
  async watch(job) {
    if (this.jobs.has(job.id)) return;
    this.begun(job);
    this.show(job);
    /** @type {JobEntry & Partial<JobPublic>} */
    let done = job;
    /** @type {unknown} */
    let failure = null;
    try {
      done = await finished(job, (now) => this.show(now));
    } catch (error) {
      failure = error;
    }
    this.jobs.delete(job.id);
    this.render();
    await this.ended(done, failure);
  }

  /** @param {JobEntry} job */
  show(job) {
    this.jobs.set(job.id, job);
    this.render();
  }

  /** Put every job into its list, and notify waiting code by a 'change'. */
  render() {
    let rest = this.shown;
    for (const { holds, element } of this.others) {
      this.fill(element, rest.filter(holds));
      rest = rest.filter((job) => !holds(job));
    }
    this.fill(this.element, rest);
    this.dispatchEvent(new Event("change"));
  }

  /**
   * @param {HTMLElement} list
   * @param {JobEntry[]} items
   */
  fill(list, items) {
    list.hidden = !items.length;
    keyed(list, items, (job) => job.id, (job) => this.row(job), (row, now) => {
      const [words, bar] = [row.querySelector(".words"), row.querySelector(".progress > div")];
      if (words) words.textContent = this.words(now);
      if (bar instanceof HTMLElement) bar.style.width = `${Math.round(now.fraction * 100)}%`;
    });
  }

  /**
   * @param {JobEntry} job
   * @returns {Row<JobEntry>}
   */
  row(job) {
    const button = h("button", { type: "button", "data-tool": "cancel" }, "Cancel");
    button.addEventListener("click", () => this.cancel(job.id, button));
    const item = h("li", { class: "job", "data-job": job.kind },
      h("p", { class: "words" }), h("div", { class: "progress" }, h("div")), button);
    return Object.assign(item, { item: job });
  }

  /**
   * @param {string} id
   * @param {HTMLButtonElement} button
   */
  async cancel(id, button) {
    button.disabled = true;
    try {
      await remove(`/api/v1/jobs/${encodeURIComponent(id)}`);
    } catch {
      button.disabled = false; // the planner did not hear it
    }
  }
}
