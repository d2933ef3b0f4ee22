// The runs of the open case: filtered by mode or arm, and by plan or route, one of them open, others beside it.
import { h } from "/static/js/dom.js";
import { sentence } from "/static/js/format.js";
import { ListFilter } from "/static/js/list-filter.js";
import { rovingRows } from "/static/js/roving.js";
import { viewOf } from "/static/js/run-views.js";
import { UNCERTIFIED, drivenAs, duration, isUncertified, modeWord, runName } from "/static/js/runs.js";
import { draw, html, nothing, repeat, titled } from "/static/js/template.js";

/** @import { RunTitle } from "/static/js/types.js" */

const ADD = "M8 3.5v9M3.5 8h9", CHOSEN = "M3.5 8.5l3 3L12.5 5";

/**
 * @typedef {{ runs: RunTitle[], open: string | null, beside: string[], planName: (id: string | null) => string, loading: boolean, trouble: string }} RunsShown
 */

export class RunsList {
  /**
   * @param {{ open: (id: string) => void, toggle: (id: string) => void }} wishes
   */
  constructor(wishes) {
    this.wishes = wishes;
    this.mode = "";
    this.plan = "";
    this.filter = new ListFilter("runs", () => this.show(this.shown));
    /** @type {RunsShown} */
    this.shown = { runs: [], open: null, beside: [], planName: () => "", loading: true, trouble: "" };
    this.element = h("div", { class: "group" });
    this.roving = rovingRows(this.element);
  }

  /** Those that the filters leave. @param {RunsShown} shown */
  listed({ runs, planName }) {
    const chosen = runs.filter((run) => (!this.mode || drivenAs(run) === this.mode) && (!this.plan || run.plan_id === this.plan));
    return this.filter.of(chosen, (run) => `${runName(run)} ${modeWord(drivenAs(run))} ${viewOf(run).robot(run)} ${planName(run.plan_id)}`);
  }

  /** @param {RunsShown} shown */
  show(shown) {
    this.shown = shown;
    const { runs, planName, loading, trouble } = shown;
    const view = viewOf(runs[0]);
    const modes = [...new Set(runs.map((run) => drivenAs(run) ?? ""))].filter(Boolean).sort();
    const plans = [...new Set(runs.map(({ plan_id: plan }) => plan ?? ""))].filter(Boolean);
    if (!modes.includes(this.mode)) this.mode = "";
    if (!plans.includes(this.plan)) this.plan = "";
    const listed = this.listed(shown);
    const choose = (/** @type {"mode" | "plan"} */ what) => (/** @type {Event} */ { currentTarget }) => {
      this[what] = /** @type {HTMLSelectElement} */ (currentTarget).value;
      this.show(this.shown);
    };
    draw(this.element, titled("Runs", null, html`
      ${runs.length > 1 ? html`<div class="run-filters">
        <select id="filter-mode" aria-label=${sentence(view.how)} @change=${choose("mode")}><option value="" ?selected=${!this.mode}>All ${view.how}s</option>${modes.map((mode) => html`<option value=${mode} ?selected=${mode === this.mode}>${modeWord(mode)}</option>`)}</select>
        <select id="filter-plan" aria-label=${sentence(view.of)} @change=${choose("plan")}><option value="" ?selected=${!this.plan}>All ${view.of}s</option>${plans.map((plan) => html`<option value=${plan} ?selected=${plan === this.plan}>${planName(plan)}</option>`)}</select></div>` : nothing}
      ${this.filter.field(runs.length)}
      <ul class="list two-lines plain-rows run-list" id="runs" aria-label="Runs">${repeat(listed, ({ id }) => id, (run) => this.row(run))}</ul>
      ${trouble ? html`<p class="words caution" role="status">${trouble}</p>` : nothing}
      ${!runs.length && !trouble ? html`<p class="empty" role="status">${loading ? "Loading runs …" : "No runs yet. Drive one first."}</p>` : nothing}
      ${runs.length && !listed.length ? html`<p class="empty">No run fits the filters.</p>` : nothing}`));
    this.roving.update();
  }

  /** @param {RunTitle} run */
  row(run) {
    const { open, beside, planName } = this.shown;
    const isOpen = run.id === open, at = beside.indexOf(run.id);
    const figures = run.score ? [duration(run.score.time_s), viewOf(run).short(run.score)].filter(Boolean).join(", ") : "not scored";
    const { robot } = viewOf(run), uncertified = isUncertified(run), of = run.score ? viewOf(run).certificate(run.score) : "", task = run.score && "task" in run.score ? run.score.task : null;
    return html`<li class="row" data-run=${run.id} aria-current=${String(isOpen)}>
      <button type="button" class="row-main" title=${planName(run.plan_id)} @click=${() => this.wishes.open(run.id)}>
        <span class="run-row-head">${modeWord(drivenAs(run))}${robot(run) ? html` <span class="number">${robot(run)}</span>` : nothing} <span class="number">${figures}</span></span><span class="row-sub">${[runName(run), task, planName(run.plan_id)].filter(Boolean).join(" · ")}</span>
        ${of ? html`<span class="row-sub certified-of">${of}</span>` : nothing}
        ${run.teacher ? html`<span class="pill teacher">teacher</span>` : nothing}
        ${uncertified ? html`<span class="pill">${UNCERTIFIED}</span>` : nothing}</button>
      <div class="row-tools"><button type="button" class="icon plain beside" data-ghost=${String(at === 0)} aria-pressed=${String(at >= 0)} ?disabled=${isOpen || !open} title=${isOpen ? "It is open" : "Beside the open run"} aria-label="Beside the open run"
        @click=${() => this.wishes.toggle(run.id)}><svg viewBox="0 0 16 16" aria-hidden="true"><path d=${at >= 0 ? CHOSEN : ADD} fill="none" stroke="currentColor" stroke-width="1.6" stroke-linecap="round" stroke-linejoin="round"></path></svg></button></div></li>`;
  }
}
