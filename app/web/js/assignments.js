// The assignment of the open plan: what its runs have to reach, and which did. The planner judges; the page shows it.
import { note } from "./dialogs.js";
import { fixed } from "./format.js";
import { jobWatch } from "./jobs.js";
import { read, remove, upload } from "./rest.js";
import { html } from "./template.js";

/** @import { AskedPublic, AssignmentOpened, CriterionPublic, ResultsPublic, ViewModel } from "./types.js" */

/** @typedef {{ id: string, name: string, plan_id: string, countdown: boolean }} Assignment */

/** Says `change` when another assignment is open, or its results have changed. */
class OpenAssignment extends EventTarget {
  constructor() {
    super();
    this.plan = "";
    /** @type {Assignment | null} the newest of the open plan */
    this.open = null;
    /** @type {ResultsPublic | null} */
    this.results = null;
    this.asked = 0; // counts requests: an answer to an earlier one is dropped
    /** @type {string[]} ids of the jobs that store a run now */
    this.storing = [];
    this.failed = false; // and it was said: a row of failures is said once
    jobWatch.addEventListener("change", () => this.hear());
  }

  /** Ask for the assignment of what is open, where that is another plan. @param {ViewModel} state */
  follow({ case: head, plan }) {
    const now = head && plan ? `${head.id}/${plan.id}` : "";
    if (now === this.plan) return;
    Object.assign(this, { plan: now, open: null, results: null, failed: false });
    this.dispatchEvent(new Event("change"));
    this.refresh();
  }

  /** A run that was stored may be one of the assignment. */
  hear() {
    const now = jobWatch.items.filter(({ kind }) => kind === "run").map(({ id }) => id);
    const stored = this.storing.some((id) => !now.includes(id));
    this.storing = now;
    if (stored && this.open) this.refresh();
  }

  /** Read it anew; what cannot be read now is as it was. */
  async refresh() {
    const request = ++this.asked, [head, plan] = this.plan.split("/");
    if (!plan) return;
    try {
      /** @type {Assignment[]} */
      const all = await read(`/api/v1/cases/${encodeURIComponent(head)}/assignments`);
      const open = all.filter(({ plan_id: id }) => id === plan).at(-1) ?? null;
      const results = open ? await read(`${address(open.id)}/results`) : null;
      if (request !== this.asked) return;
      Object.assign(this, { open, results, failed: false });
    } catch (error) {
      if (request === this.asked && !this.failed) {
        this.failed = true;
        note(`The assignment cannot be read: ${error instanceof Error ? error.message : error}`, { error: true });
      }
      return;
    }
    this.dispatchEvent(new Event("change"));
  }
}

export const assignment = new OpenAssignment();

/** @param {string} id */
const address = (id) => `/api/v1/assignments/${encodeURIComponent(id)}`;

/** @param {File} file @returns {Promise<AssignmentOpened>} */
export function openAssignment(file) {
  const form = new FormData();
  form.append("file", file);
  return upload("/api/v1/assignments", form, () => {});
}

/** @param {string} id */
export const closeAssignment = (id) => remove(address(id));

/** @param {string} id */
export const resultsAddress = (id) => `${address(id)}/results?format=csv`;

/**
 * The limit of a criterion, such as '≤ 60 s'.
 * @param {AskedPublic} criterion
 */
export function limitWords({ name, limit, unit }) {
  if (typeof limit === "boolean") return limit ? "yes" : "no";
  return `${name.startsWith("max_") ? "≤" : "≥"} ${Number(limit.toPrecision(4))}${unit ? ` ${unit}` : ""}`;
}

/**
 * The value of a criterion in a run.
 * @param {CriterionPublic} criterion
 */
export function valueWords({ value, unit }) {
  if (value === null) return "–";
  if (typeof value === "boolean") return value ? "yes" : "no";
  return fixed(value, Number.isInteger(value) && !unit ? 0 : unit === "s" ? 1 : Math.abs(value) < 1 ? 3 : 1);
}

/** @param {(AskedPublic | CriterionPublic)[]} criteria with values: whether each was reached */
export function criteriaList(criteria) {
  return html`<dl class="facts criteria">${criteria.map((one) => {
    const judged = "value" in one;
    return html`<dt>${one.label}</dt><dd data-passed=${judged ? String(one.passed) : ""}>${judged ? `${one.passed ? "✓" : "✗"} ${valueWords(one)}` : ""}${typeof one.limit === "boolean" && judged ? "" : `${judged ? ", " : typeof one.limit === "boolean" ? "wanted: " : ""}${limitWords(one)}`}</dd>`;
  })}</dl>`;
}
