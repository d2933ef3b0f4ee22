// What of a threshold is kept, shown while it is chosen: at half resolution at once, in full when the hand rests.
import { finished } from "/static/js/jobs.js";
import { remove, send } from "/static/js/rest.js";
import { thresholdPreview } from "/static/js/threshold-preview.js";

/** @import { JobPublic } from "/static/js/types.js" */
/** @typedef {{ low_hu: number | null, high_hu: number | null, preset: string, crop_mm: number[][] | null, largest: boolean, least_mm3: number }} IslandsRequest */

const PATIENCE_MS = 300; // what an earlier request found stays as long, so that nothing blinks while a slider moves

/** One question at a time; while one is asked, the newest request waits. */
export class IslandPreview {
  /** @param {(words: string) => void} say how much is kept */
  constructor(say) {
    this.say = say;
    /** @type {{ caseId: string, request: IslandsRequest } | null} what is wanted */
    this.wanted = null;
    this.key = "";
    this.busy = false;
    /** @type {ReturnType<typeof setTimeout> | undefined} until what an earlier request found goes */
    this.waiting = undefined;
    /** @type {string | null} the job that looks at every voxel */
    this.job = null;
  }

  /**
   * @param {string} caseId
   * @param {IslandsRequest | null} request null: all of the threshold is kept
   */
  want(caseId, request) {
    const key = request ? JSON.stringify([caseId, request]) : "";
    if (key === this.key) return;
    this.key = key;
    this.wanted = request && { caseId, request };
    this.stop();
    clearTimeout(this.waiting);
    if (request) this.waiting = setTimeout(() => this.wait(), PATIENCE_MS);
    if (!request) {
      thresholdPreview.keep(null);
      this.say("");
    } else if (!this.busy) this.ask();
  }

  wait() {
    thresholdPreview.keep(null);
    this.say("Counting islands …");
  }

  async ask() {
    this.busy = true;
    while (this.wanted) {
      const { key } = this;
      const { caseId, request } = this.wanted;
      this.wanted = null;
      try {
        await this.show(await fetch(`${addressOf(caseId)}`, {
          method: "POST", credentials: "same-origin", headers: { "Content-Type": "application/json" }, body: JSON.stringify(request),
        }), caseId, key, " (half resolution)");
      } catch (error) {
        if (key === this.key) this.fail(error);
      }
    }
    this.busy = false;
  }

  /**
   * The hand rests: look at every voxel.
   * @param {string} caseId
   * @param {IslandsRequest | null} request
   */
  async full(caseId, request) {
    this.want(caseId, request);
    if (!request || this.job) return;
    const { key } = this;
    if (thresholdPreview.kept?.key === key && thresholdPreview.kept.step === 1) return;
    try {
      const job = await send(`${addressOf(caseId)}/full`, request);
      if (key !== this.key) {
        remove(`/api/v1/jobs/${encodeURIComponent(job.id)}`).catch(() => {});
        return;
      }
      this.job = job.id;
      const done = await finished(job, () => {});
      if (key === this.key) await this.show(await fetch(`${addressOf(caseId)}/${encodeURIComponent(done.result ?? "")}`, { credentials: "same-origin" }), caseId, key, "");
    } catch (error) {
      if (key === this.key) this.fail(error);
    }
    if (key === this.key) this.job = null;
  }

  /** Whatever looks at every voxel looks for something that is not wanted any more. */
  stop() {
    if (this.job) remove(`/api/v1/jobs/${encodeURIComponent(this.job)}`).catch(() => {}); // it has ended
    this.job = null;
  }

  /**
   * @param {Response} response
   * @param {string} caseId
   * @param {string} key
   * @param {string} how
   */
  async show(response, caseId, key, how) {
    if (!response.ok) throw new Error((await response.json()).error.message);
    const runs = new Uint32Array(await response.arrayBuffer());
    const told = (/** @type {string} */ name) => Number(response.headers.get(name));
    if (key !== this.key || (how && thresholdPreview.kept?.key === key)) return; // every voxel was looked at already
    clearTimeout(this.waiting);
    thresholdPreview.keep({ caseId, key, runs, step: told("X-Step") });
    this.say(`${told("X-Islands").toLocaleString("en")} islands, ${told("X-Left-Out").toLocaleString("en")} left out, ${(told("X-Volume-Mm3") / 1000).toFixed(1)} ml kept${how}.`);
  }

  /** @param {unknown} error */
  fail(error) {
    clearTimeout(this.waiting);
    thresholdPreview.keep(null);
    this.say(error instanceof Error ? error.message : String(error));
  }
}

/** @param {string} caseId */
function addressOf(caseId) {
  return `/api/v1/cases/${encodeURIComponent(caseId)}/segment/islands`;
}
