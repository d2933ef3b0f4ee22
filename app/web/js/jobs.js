// Running jobs, from the planner's messages, and waiting for one of them.
import { PlannerError, jobNow } from "./rest.js";

/** @import { Connection } from "./connection.js" */
/** @import { JobEntry, JobPublic } from "./types.js" */

/** Says 'change' for each message about jobs. */
class JobWatch extends EventTarget {
  constructor() {
    super();
    this.heard = 0; // messages about jobs so far
    /** @type {JobEntry[]} what waits or runs */
    this.items = [];
  }

  /** @param {Connection} connection */
  follow(connection) {
    connection.on("state", ({ state, changed }) => {
      if (state.jobs && changed.includes("jobs")) this.hear(state.jobs.items);
    });
  }

  /** @param {JobEntry[]} items */
  hear(items) {
    this.heard += 1;
    this.items = items;
    this.dispatchEvent(new Event("change"));
  }

  /**
   * Wait until more was heard than so many messages.
   * @param {number} heard
   */
  async more(heard) {
    if (this.heard === heard) await new Promise((resolve) => { this.addEventListener("change", resolve, { once: true }); });
  }
}

export const jobWatch = new JobWatch();

/**
 * How far a job is.
 * @param {JobEntry} job
 */
export function stageWords({ state, stage, fraction }) {
  return state === "queued" ? "waiting for its turn" : `${stage}, ${Math.round(fraction * 100)} %`;
}

/**
 * Wait until a job is done; throws what it failed with, and for a cancelled one what `wasCancelled` tells.
 * @param {JobEntry & Partial<JobPublic>} job
 * @param {(job: JobEntry) => void} onProgress
 * @returns {Promise<JobPublic>}
 */
export async function finished(job, onProgress) {
  let now = job;
  let heard = -1; // messages about it may precede the answer that names it
  while (now.state === "queued" || now.state === "running") {
    onProgress(now);
    await jobWatch.more(heard);
    heard = jobWatch.heard;
    // One that is missing has ended, or began after the message.
    now = jobWatch.items.find(({ id }) => id === job.id) ?? await jobNow(job.id);
  }
  if (now.state === "done") return /** @type {JobPublic} */ (now);
  throw now.error ? new PlannerError(now.error) : new Error("The planner says that this failed, and not why.");
}
